"""Pictures. The only package that imports matplotlib, and without its global state."""

from reojax.plot.capture import comparison_figure as comparison_figure
from reojax.plot.files import FORMATS as FORMATS, check_picture as check_picture, save as save
from reojax.plot.history import history_figure as history_figure
