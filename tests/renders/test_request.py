# SPDX-License-Identifier: GPL-3.0-or-later
"""A render as a value: written and read back the same, known by what decides its pixels, and rendered without a trace."""

import dataclasses
import json
import os

import bpy
import numpy as np
import OpenImageIO as oiio
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nim_addon.base.version import VERSION
from nim_addon.caustics import PHOTONS
from nim_addon.cycles.images import read_metadata
from nim_addon.cycles.material import resolve
from nim_addon.physics import MEDIA
from nim_addon.renders import asked as asked_module
from nim_addon.renders import changes
from nim_addon.renders import session as session_module
from nim_addon.renders.blends import Blend
from nim_addon.renders.request import NoPhotons, NotTraced, Request, Session
from nim_addon.scenes import scene_type
from nim_addon.scenes.stage import Pose

TINY = {"size": (24, 16), "samples": 2, "backend": "nodes"}
PYRAMID = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"


def dark(scene):
    scene.world = None


def pixels(file):
    return oiio.ImageBuf(str(file)).get_pixels(oiio.FLOAT)[..., :3]


def as_from_a_file(record):
    return json.loads(json.dumps(record))


# ------------------------------------------------------------------------------------------------ as JSON

number = st.floats(-100, 100)
poses = st.builds(
    Pose,
    st.tuples(number, number, number),
    st.tuples(number, number, number),
    st.floats(1, 179),
    st.sampled_from(["AUTO"]),
)
parameters = st.one_of(
    st.builds(
        lambda n, companions: scene_type("sphere").parameters(n=n, companions=companions),
        st.floats(-10, 10).filter(lambda n: abs(n) > 1e-3),
        st.booleans(),
    ),
    st.builds(
        lambda liquid, mu, time: scene_type("pool").parameters(liquid=liquid, mu=mu, time=time),
        st.sampled_from([MEDIA["nim"], MEDIA["nim-4.1"]]),
        st.floats(-99, -0.1),
        st.floats(0, 3600),
    ),
    st.just(scene_type("glass").parameters(liquid=None, view="top")),
)
options = st.fixed_dictionaries(
    {},
    optional={
        "size": st.tuples(st.integers(1, 16384), st.integers(1, 16384)),
        "samples": st.integers(1, 1 << 20),
        "seed": st.integers(0, 2**31 - 1),
        "backend": st.sampled_from(["auto", "osl", "nodes"]),
        "denoise": st.booleans(),
        "keep_noise": st.booleans(),
        "spectral": st.booleans(),
        "photons": st.integers(1, 1 << 40),
        "texels": st.integers(1, 16384),
        "pose": poses,
        "change": st.just(changes.register(dark)),
    },
)


def name_of(values):
    return next(name for name in ("sphere", "pool", "glass") if isinstance(values, scene_type(name).parameters))


@given(parameters, options, st.sampled_from([None, "path", "traced"]))
def test_a_record_is_read_back_the_same(values, options, way):
    if way == "path":
        options.pop("photons", None)
    if options.get("spectral") and "samples" in options:
        options |= {"spectral_passes": 2, "samples": options["samples"] // 2 * 2 or 2}
    elif not options.get("spectral"):
        options["wavelength"] = 486.13
    asked = Request(name_of(values), values, caustics=way, **options)
    record = as_from_a_file(asked.record())
    assert record == asked.record()
    assert Request.from_record(record) == asked
    assert Request.from_record(record).record() == record
    assert hash(Request.from_record(record)) == hash(asked)


def test_what_is_usual_is_recorded():
    record = Request.of("Sphere", ["n=1.5"]).record()
    assert record == {
        "nimray": VERSION,
        "scene": "sphere",
        "parameters": {"n": 1.5, "mu": 1.0, "roughness": 0.0, "companions": False, "sun_angle": 16.0},
        "size": [800, 600],
        "samples": 128,
        "seed": 0,
        "denoise": False,
        "backend": "auto",
        "blender": bpy.app.version_string,
    }
    traced = Request.of("pool", caustics="traced").record()
    assert (traced["caustics"], traced["photons"]) == ("traced", 1 << 24)


def test_what_an_earlier_version_recorded_is_read(tmp_path, empty_file):
    """An image of the commit 2137d56."""
    record = {
        "nimray": "0.1.0",
        "scene": "sphere",
        "parameters": {"n": -1.33, "mu": -1.0, "companions": True, "sun_angle": 16.0},
        "size": [24, 16],
        "samples": 2,
        "seed": 7,
        "denoise": False,
        "backend": "nodes",
        "caustics": "path",
        "blender": "4.5.15 LTS",
    }
    asked = Request.from_record(record)
    # what it did not know yet is as it was then
    now = {**record, "parameters": {**record["parameters"], "roughness": 0.0}}
    assert {**asked.record(), "nimray": "0.1.0", "blender": "4.5.15 LTS"} == now
    made = asked.render(tmp_path, "one")
    assert Request.again(made.png) == (asked, made.record)


REFUSED = [
    ({"size": (0, 10)}, "size 0x10 is out of range; each side lies between 1 and 16384 pixels"),
    ({"size": (99999, 10)}, "out of range"),
    ({"size": (1.5, 10)}, "not a size"),
    ({"size": "10x10"}, "not a size"),
    ({"size": (10,)}, "not a size"),
    ({"samples": 0}, "samples 0 is out of range; it lies between 1 and 1048576"),
    ({"samples": 1.5}, "not a whole number"),
    ({"samples": True}, "not a whole number"),
    ({"samples": "4"}, "not a whole number"),
    ({"seed": -1}, "seed -1 is out of range"),
    ({"seed": 2**31}, "out of range"),
    ({"backend": "gpu"}, "there is no backend 'gpu'; the ones that exist are auto, osl, nodes"),
    ({"caustics": "maybe"}, "there is no caustics 'maybe'"),
    ({"caustics": "traced", "photons": 0}, "photons 0 is out of range"),
    ({"caustics": "path", "photons": 100}, "photons are for caustics that are traced"),
    ({"denoise": 1}, "neither True nor False"),
    ({"keep_noise": "yes"}, "neither True nor False"),
    ({"spectral": "yes"}, "neither True nor False"),
    ({"spectral": True, "wavelength": 550}, "a spectral render has all wavelengths"),
    ({"wavelength": 0.55}, "for 0.55 micrometres write 550"),
    ({"wavelength": 0}, "a wavelength of 0 nm is none"),
    ({"wavelength": 1064}, "wavelength 1064 is not visible; it lies between 380 and 730 nanometres"),
    ({"wavelength": "red"}, "wavelength 'red' is not a number; give nanometres, such as 550"),
    ({"spectral_passes": 4}, "spectral passes are of a spectral render"),
    ({"spectral": True, "spectral_passes": 3}, "no power of two"),
    ({"spectral": True, "spectral_passes": 128}, "out of range"),
    ({"spectral": True, "spectral_passes": 8, "samples": 12}, "or a number of samples such as 16"),
    ({"texels": 0}, "texels 0 is out of range"),
    ({"frame": 3}, "frame is of the animation of a .blend"),
    ({"pose": ((0, 0), (0, 0, 0), 30, "AUTO")}, "no pose"),
    ({"pose": ((0, 0, 0), (0, 0, float("nan")), 30, "AUTO")}, "no pose"),
    ({"pose": ((0, 0, 0), (0, 0, 1), 180, "AUTO")}, "no pose"),
    ({"pose": ((0, 0, 0), (0, 0, 1), 30, "auto")}, "no pose"),
    ({"change": "nobody.did"}, "there is no change"),
    ({"blend": Blend("/a.blend", "Scene", "0")}, "give one of them"),
    ({"scene": "spere"}, "did you mean sphere?"),
    ({"scene": None}, "give one of them"),
    ({"parameters": {"n": 1}}, "no parameters of the sphere"),
    ({"parameters": scene_type("pool").parameters()}, "no parameters of the sphere"),
]


@pytest.mark.parametrize(("values", "says"), REFUSED, ids=[str(values)[:40] for values, _ in REFUSED])
def test_what_no_render_has_is_refused_in_a_sentence(values, says, one_sentence):
    with pytest.raises(ValueError) as caught:
        Request(**{"scene": "sphere", **values})
    if "did you mean" not in says:
        one_sentence(caught.value)
    assert says in str(caught.value)


RECORD = Request.of("sphere", ["n=-1.5"], **TINY).record()
WRONG = {
    "nimray": [None, 5, "", "new", "0.1\n"],
    "parameters": [None, "n=1.5", [["n", 1.5]], {"nn": 1}, {"n": float("nan")}, {"n": "x"}],
    "size": [None, "24x16", [24], [24, 16, 1], [0, 16], [24.0, 16], [True, 1]],
    "samples": [None, 0, 2.0, "4", True],
    "seed": [None, -1, 1.5],
    "denoise": [None, 0, "yes"],
    "backend": [None, "gpu", ["osl"]],
    "caustics": [None, "maybe"],
    "photons": [None, 0, 1.5],
    "texels": [None, 0],
    "frame": [None, 1.5, 1],
    "keep_noise": [None, 1],
    "spectral": [None, 1, "yes"],
    "spectral_passes": [None, 2, 3],
    "wavelength": [None, 0, 0.5, "550", True, 1e9],
    "wavelengths": [[400, 500]],
    "pose": [None, [], [[0, 0, 0], [0, 0, 1], "30", "AUTO"]],
    "change": [None, 5, "os.system"],
    "code": [None, 5, "of another"],
    "blender": [None, 5],
    "blend": [None, "a.blend", {}, {"file": "/nowhere.blend", "scene": "Scene", "sha256": "0"}],
    "shader": ["x"],
}
CASES = [(key, value) for key, values in WRONG.items() for value in values]


@pytest.mark.parametrize(("key", "value"), CASES, ids=[f"{key}-{str(value)[:20]!r}" for key, value in CASES])
def test_a_record_that_no_render_has_is_refused_in_a_sentence(key, value, one_sentence):
    with pytest.raises(ValueError) as caught:
        Request.from_record({**RECORD, key: value}, "mine.exr")
    if not isinstance(value, dict):  # which has two where it says which parameters there are
        one_sentence(caught.value, "mine.exr")
    assert str(caught.value).startswith("mine.exr")


@pytest.mark.parametrize(
    "text",
    ["nim-causal", "n=-1.33+1e-06j", "n=-1.33,length=0.05", "epsilon=drude(360 0),mu=drude(360 0)", "gold", "n-sf11"],
)
def test_a_record_holds_any_medium(text):
    for scene, key in (("pool", "liquid"), ("sphere", "n")):
        request = Request.of(scene, [f"{key}={text}"])
        record = as_from_a_file(request.record())
        assert record["parameters"][key] == text
        assert Request.from_record(record).parameters == request.parameters
        assert "/" not in request.name and "=" not in request.name


def test_a_record_of_a_later_version_or_with_less_is_refused(one_sentence):
    for key in RECORD.keys() - {"backend"}:
        with pytest.raises(ValueError) as caught:
            Request.from_record({name: value for name, value in RECORD.items() if name != key})
        one_sentence(caught.value, f"does not record its {key}")
    with pytest.raises(ValueError) as caught:
        Request.from_record({**RECORD, "nimray": "99"})
    assert "was made by nimray 99" in str(caught.value)


# ------------------------------------------------------------------------------------------------ its key


def test_keys_differ_where_pixels_do(monkeypatch):
    usual = Request.of("sphere", ["n=-1.5"], **TINY, caustics="path")
    others = [
        {"size": (16, 24)},
        {"samples": 3},
        {"seed": 1},
        {"backend": "osl"},
        {"denoise": True},
        {"denoise": True, "keep_noise": True},
        {"caustics": "traced"},
        {"caustics": "traced", "photons": 5},
        {"caustics": "traced", "photons": 5, "texels": 6},
        {"pose": Pose((0, -5, 1), (0, 0, 1), 30)},
        {"change": changes.register(dark)},
        {"code": "other"},
        {"spectral": True},
        {"spectral": True, "spectral_passes": 2},
        {"wavelength": 500.0},
        {"parameters": scene_type("sphere").parameters(n=-1.5, companions=True)},
    ]
    requests = [usual, *(dataclasses.replace(usual, **values) for values in others)]
    assert len({one.key() for one in requests}) == len(requests)
    assert dataclasses.replace(usual, backend="auto").key() in {usual.key(), requests[4].key()}
    before = usual.key()
    monkeypatch.setattr(asked_module, "VERSION", "9.0")
    assert usual.key() != before


@pytest.mark.parametrize("sky", ["sunny", "overcast"])
def test_what_is_open_is_in_the_key_as_it_is_decided(empty_file, monkeypatch, sky):
    asked = Request.of("pool", {"liquid": "nim", "sky": sky}, size=(24, 16), samples=2)
    decided = asked.decided()
    assert asked.caustics is None and asked.backend == "auto"
    assert (decided.caustics, decided.photons) == {"sunny": ("traced", PHOTONS), "overcast": ("path", None)}[sky]
    assert decided.backend == resolve("auto")
    recorded = Request.from_record(as_from_a_file(decided.record()))
    assert recorded == decided and len(bpy.data.scenes) == 1
    key = asked.key()
    monkeypatch.setattr(session_module.caustics, "best_way", None)  # nobody asks again what is decided
    assert recorded.key() == decided.key() == key


def test_files_count_by_their_content(tmp_path, empty_file):
    for name, text in (("one", PYRAMID), ("two", PYRAMID), ("three", PYRAMID.replace("v 0 0 1", "v 0 0 2"))):
        (tmp_path / f"{name}.obj").write_text(text)
    keys = [Request.of("glass", {"figures": str(tmp_path / f"{name}.obj")}).key() for name in ("one", "two", "three")]
    assert keys[0] == keys[1] != keys[2]
    assert Request.of("glass", {"figures": "monkey"}).key() not in keys


def test_files_of_media_count_by_their_content(tmp_path, empty_file):
    rows = "DATA:\n  - type: tabulated n\n    data: |\n        0.3 1.5\n        0.8 "
    for name, last in (("one", 1.4), ("two", 1.4), ("three", 1.3)):
        (tmp_path / f"{name}.yml").write_text(f"{rows}{last}\n")
    for scene, key in (("glass", "liquid"), ("sphere", "n")):
        keys = [
            Request.of(scene, {key: str(tmp_path / f"{name}.yml")}, caustics="path").key()
            for name in ("one", "two", "three")
        ]
        assert keys[0] == keys[1] != keys[2]


# ------------------------------------------------------------------------------------------------ the act


def test_a_render_leaves_nothing_and_touches_nothing(tmp_path, default_file):
    kind = scene_type("sphere")
    mine = kind.build(kind.parameters(n=1.5), "nodes")
    before, objects = set(bpy.data.user_map()), [one.name for one in mine.objects]
    made = Request.of("sphere", **TINY).render(tmp_path)
    assert (made.exr, made.png) == (tmp_path / "sphere.exr", tmp_path / "sphere.png")
    assert read_metadata(made.exr) == read_metadata(made.png) == made.record
    assert pixels(made.exr).shape == (16, 24, 3)
    came = {data.name for data in set(bpy.data.user_map()) - before}
    assert came <= {"Render Result"}
    assert [one.name for one in mine.objects] == objects
    # it still is the one that the next build takes the place of
    assert kind.build(kind.parameters(), "nodes") == mine


def test_what_is_there_is_not_rendered_again(tmp_path, empty_file):
    asked = Request.of("sphere", **TINY)
    first = asked.render(tmp_path)
    assert not first.was_there
    assert asked.key() == Request.again(first.exr)[0].key()
    assert asked.render(tmp_path) == first._replace(was_there=True)
    assert asked.render(tmp_path, keep=False) == first
    assert not dataclasses.replace(asked, seed=1).render(tmp_path).was_there
    assert not asked.render(tmp_path).was_there
    first.png.write_bytes(first.png.read_bytes()[:-20])  # cut off
    assert not asked.render(tmp_path).was_there
    assert not asked.render(tmp_path, blend=True).was_there
    assert first.exr.with_suffix(".blend").is_file()
    assert asked.render(tmp_path, blend=True).was_there


def test_a_mesh_file_that_has_changed_is_another(tmp_path, empty_file):
    mesh = tmp_path / "one.obj"
    mesh.write_text(PYRAMID)
    os.utime(mesh, (1, 1))
    asked = Request.of("glass", {"figures": str(mesh)}, **TINY, caustics="path")
    first = asked.render(tmp_path, "one")
    assert asked.render(tmp_path, "one").was_there
    mesh.write_text(PYRAMID.replace("v 0 0 1", "v 0 0 2"))
    os.utime(mesh, (later := first.exr.stat().st_mtime + 1, later))
    assert not asked.render(tmp_path, "one").was_there


def test_a_scene_is_built_once_for_several_seeds(tmp_path, empty_file, monkeypatch):
    built = []
    kind = scene_type("sphere")
    counted = kind._replace(build=lambda *given: built.append(given) or kind.build(*given))
    monkeypatch.setattr(session_module, "scene_type", lambda *_, **__: counted)
    with Session(Request.of("sphere", **TINY, caustics="path"), persistent=True) as session:
        records = [session.render(tmp_path, f"s.{seed}", seed=seed).record for seed in (0, 1)]
        assert session.render(tmp_path, "s.1", seed=1).was_there
    assert [record["seed"] for record in records] == [0, 1] and len(built) == 1
    assert not np.array_equal(pixels(tmp_path / "s.0.exr"), pixels(tmp_path / "s.1.exr"))
    with Session(Request.of("sphere", **TINY, caustics="path")) as session:
        assert session.render(tmp_path, "s.1", seed=1).was_there
    assert len(built) == 1  # none was needed


def test_a_change_and_a_pose_are_in_the_picture(tmp_path, empty_file):
    usual = Request.of("sphere", **TINY)
    pose = Pose((0.0, 0.0, 9.0), (0.0, 0.0, 0.0), 30.0)
    changed, posed = (
        dataclasses.replace(usual, **values).render(tmp_path, name).exr
        for name, values in (("dark", {"change": changes.register(dark)}), ("above", {"pose": pose}))
    )
    assert pixels(changed).max() == 0
    assert not np.array_equal(pixels(posed), pixels(usual.render(tmp_path).exr))


def test_caustics_are_traced_where_they_can_be(tmp_path, empty_file):
    sunny = Request.of("pool", {"sky": "sunny", "sun_angle": 0.53}, **TINY)
    made = dataclasses.replace(sunny, photons=20000).render(tmp_path, "lit")
    assert (made.record["caustics"], made.record["photons"]) == ("traced", 20000)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["lit.exr", "lit.png"]
    plain = Request.of("pool", **TINY)
    with pytest.raises(NoPhotons):
        dataclasses.replace(plain, photons=20000).render(tmp_path / "new")
    with pytest.raises(NotTraced, match="no light to trace"):
        dataclasses.replace(plain, caustics="traced").render(tmp_path / "new")
    assert not (tmp_path / "new").exists()
    assert plain.render(tmp_path, "by chance").record["caustics"] == "path"


def test_a_folder_that_cannot_be_written_is_seen_before_anybody_is_told_how_far_it_is(tmp_path, empty_file):
    (tmp_path / "file").touch()
    told = []
    with pytest.raises(OSError, match="cannot write into"):
        Request.of("sphere", size=(8, 6), samples=1).render(
            tmp_path / "file" / "folder", showing=lambda name, samples: told.append(name)
        )
    assert not told


def test_a_blender_without_a_denoiser_is_told_so_before_the_work(tmp_path, empty_file, monkeypatch):
    monkeypatch.setattr(session_module, "can_denoise", lambda: False)
    with pytest.raises(RuntimeError, match="without OpenImageDenoise"):
        Request.of("sphere", denoise=True, **TINY).render(tmp_path / "new")
    assert not (tmp_path / "new").exists()


def test_a_sequence_moves_and_has_a_noise_of_its_own(one_sentence):
    asked = Request.of("sea", {"time": 1}, seed=2**31 - 3)
    moments = asked.sequence(11, 13, 20)
    assert [one.parameters.time for one in moments.values()] == pytest.approx([1.5, 1.55, 1.6])
    assert [one.seed for one in moments.values()] == [8, 9, 10] and list(moments) == [11, 12, 13]
    with pytest.raises(ValueError) as caught:
        Request.of("sphere").sequence(1, 2, 24)
    one_sentence(caught.value, "nothing moves in the sphere")
