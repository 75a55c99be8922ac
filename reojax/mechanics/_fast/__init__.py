"""The fast form of `reojax.mechanics.momentum` and of the integration of `R' = R hat(omega)`.

XLA's CPU code is fast when every scalar component is an array of its own: `vmap` then makes each one
a contiguous array, a whole evaluation of omega becomes one vectorised loop, and no small matrix products
are left. So vectors here are triples of scalars, and an evaluation is written for one scalar shape, all
quadrature nodes of the path. Files, in the order of use:

    scalar        arithmetic that leaves out zeros known beforehand; vectors and matrices of scalars
    parameters    a robot's arrays as scalars, with the zeros and frame axes that are known
    sincos        a sine and cosine that vectorise
    materialize   values computed once, side by side, for many readers
    nodes         joint angles and rates at the quadrature nodes of a path, and sums over nodes
    recursion     inertia and momentum from the tips to the base: angular velocity at all nodes (thesis eq. 2.14)
    magnus        omega at the nodes of a step to the rotation over the step
    quaternions   the ordered product of the steps' rotations
    net_rotation  all of it in a row, and its derivative, which needs
    momentum_jvp  the angular momentum with everything moving, for forward mode, and
    momentum_vjp  its derivative in closed form, for reverse mode
    rolled        the passes over the tree as loops over joints: short to compile, for long robots
    blocking      batches of designs in blocks that stay in the cache
"""
