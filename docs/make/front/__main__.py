"""Write the pictures of the README and of the start page: ``python -m docs.make.front``.

Needs OpenGL, as ``notchbend run`` does for its picture of the tube.
"""

from docs.make.front.animation import animation
from docs.make.front.example import run_example
from docs.make.front.still import DARK, LIGHT, bent_tube, draw
from docs.make.pages import IMAGES
from hysteresis.files import write_files

if __name__ == "__main__":
    example = run_example()
    tube = bent_tube(example)
    stills = {
        IMAGES / f"front-{name}.png": draw(example, tube, page) for name, page in (("light", LIGHT), ("dark", DARK))
    }
    write_files({**stills, IMAGES / "bending.gif": animation()})
