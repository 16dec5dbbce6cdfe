"""Writing a scene's file and loading it."""

import pytest

from sim.scene import load_scene

from .gltf_builder import Builder


@pytest.fixture
def builder():
    return Builder()


@pytest.fixture
def load_glb(tmp_path):
    """Function from a glTF builder to the scene that its .glb is."""

    def write_and_load(builder):
        (tmp_path / "test.glb").write_bytes(builder.glb())
        return load_scene(tmp_path / "test.glb")

    return write_and_load
