# SPDX-License-Identifier: GPL-3.0-or-later
"""What the tests share: an empty Blender file, a render as an array, and what a rejection must read like."""

import os
import re
import signal
import sys
from pathlib import Path

import pytest
from hypothesis import settings

# How long an example takes is as the machine is busy.
settings.register_profile("untimed", deadline=None)
settings.load_profile("untimed")

# In the background of a shell, or under nohup, signals are ignored, by the commands that are tried as well.
for name, usual in (("SIGINT", signal.default_int_handler), ("SIGQUIT", signal.SIG_DFL), ("SIGHUP", signal.SIG_DFL)):
    if hasattr(signal, name) and signal.getsignal(getattr(signal, name)) is signal.SIG_IGN:
        signal.signal(getattr(signal, name), usual)

# what tests start finds the package from any folder
os.environ["PYTHONPATH"] = str(Path(__file__).parents[1])


def pytest_sessionfinish(session, exitstatus):
    """Remember how it ended."""
    session.config.ended = int(exitstatus)


def pytest_unconfigure(config):
    """End here where Blender is loaded as a module: as it exits, 4.2 crashes, and later ones hang now and then."""
    if "bpy" in sys.modules and hasattr(config, "ended"):
        sys.stdout.flush()
        os._exit(config.ended)


@pytest.fixture(scope="session")
def data():
    """The folder of reference data."""
    return Path(__file__).parent / "data"


@pytest.fixture
def empty_file():
    """Blender with nothing in the file but one scene."""
    import bpy

    from nim_addon.base.streams import quiet

    with quiet():
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)


@pytest.fixture
def default_file():
    """Blender as it starts for a person: a cube, a lamp, a camera, a world."""
    import bpy

    from nim_addon.base.streams import quiet

    with quiet():
        bpy.ops.wm.read_homefile(use_factory_startup=True)


@pytest.fixture
def render(tmp_path):
    """render(scene) -> (height, width, 3) linear float32, by way of a 32-bit EXR; the settings are the caller's."""
    import bpy
    import OpenImageIO as oiio

    from nim_addon.base.streams import quiet

    def picture(scene):
        file = tmp_path / "picture.exr"
        scene.render.image_settings.file_format = "OPEN_EXR"
        scene.render.image_settings.color_depth = "32"
        scene.render.filepath = str(file)
        with quiet():
            bpy.ops.render.render(write_still=True, scene=scene.name)
        return oiio.ImageBuf(str(file)).get_pixels(oiio.FLOAT)[..., :3]

    return picture


@pytest.fixture
def one_sentence():
    """one_sentence(error, *words) -> its text, seen to be one line, one full stop at its end, and to hold the words."""

    def text(error, *words):
        message = str(error)
        assert message.endswith(".") and "\n" not in message, message
        assert not re.search(r"\.\s", message), f"more than one sentence: {message}"
        for word in words:
            assert word in message, f"{word!r} is missing from: {message}"
        return message

    return text
