"""The same robots in other people's code, to compare with: Pinocchio and MuJoCo, imported on use."""

from reojax.interop.foreign import Foreign as Foreign, Rotor as Rotor, rotors as rotors, split as split
from reojax.interop.mujoco import mujoco_model as mujoco_model, mujoco_momentum as mujoco_momentum
from reojax.interop.pinocchio import pinocchio_model as pinocchio_model, pinocchio_momentum as pinocchio_momentum
