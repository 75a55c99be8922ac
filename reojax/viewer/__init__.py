"""A motion to look at in a browser: one HTML file that needs nothing else (`view`), or live (`serve`)."""

from reojax.viewer.html import view as view
