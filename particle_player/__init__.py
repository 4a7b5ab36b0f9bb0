"""A player of moving particles for web pages: one HTML file that opens in any browser from 2023 on, without a network.

The particles are drawn as discs, 100,000 of them in some 20 ms without a graphics card. One moves through time by a slider, zooms
and shifts the view, chooses the quantity that is shown in colour, and reads the values of a particle with the mouse. Several
movies stand side by side, with the same time, view and colours.

`save_player` writes a page that has the player only; `parts_of_page` gives its parts for a page with more on it. The package
needs NumPy and Matplotlib, and nothing else of Talus.

Example:
    >>> import numpy as np
    >>> from particle_player import Movie, Quantity, Scene, save_player
    >>> scene = Scene(np.array([(0.0, 0.0), (2.0, 0.0), (0.0, 1.0)]), np.array([(0, 1, 2)]))
    >>> x = np.random.default_rng(0).random((500, 2))
    >>> frames = [{"time": t, "position": x + [t, 0.0], "volume": np.full(500, 2e-3), "speed": np.ones(500)} for t in (0.0, 1.0)]
    >>> save_player("block.html", [Movie("A block", scene, frames, {"speed": Quantity("Speed", "m/s")})])
"""

from particle_player.movie import Movie
from particle_player.page import Parts, parts_of_page, save_player
from particle_player.scene import Quantity, Scene, axis_labels, boundary_edges, colour_limits, disc_diameter

__all__ = [
    "Movie",
    "Parts",
    "Quantity",
    "Scene",
    "axis_labels",
    "boundary_edges",
    "colour_limits",
    "disc_diameter",
    "parts_of_page",
    "save_player",
]
