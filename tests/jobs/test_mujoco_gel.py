"""A gel in MuJoCo: its force and the geom's pose reach the gel; any geom presses; the example runs."""

from pathlib import Path

import numpy as np
import pytest
from by_path import module_at

mujoco = pytest.importorskip("mujoco", reason="the extra [mujoco] is not installed")
pytest.importorskip("gymnasium", reason="the extra [mujoco] is not installed")

from tactile_core.errors import TactileError  # noqa: E402
from tactile_core.geometry.indenters import Sphere  # noqa: E402
from tactile_core.jobs.gel import Gel  # noqa: E402
from tactile_core.jobs.gel_observation import marker_nodes, observation_space, observe  # noqa: E402
from tactile_core.jobs.mujoco_gel import MujocoGel  # noqa: E402
from tactile_core.sensors.calibration_file import load_calibration  # noqa: E402

EXAMPLE = Path(__file__).resolve().parents[2] / "scenes" / "mujoco_grasp" / "grasp.py"
# A gel that lies on its back under a body of 60 g: y into the gel is world -z, x along the finger world x.
LYING = """
<mujoco>
  <option timestep="0.002"/>
  <asset><mesh name="star" vertex="{vertices}"/></asset>
  <worldbody>
    <geom name="floor" type="plane" size="1 1 1" pos="0 0 -0.1"/>
    <body pos="0 0 0" xyaxes="1 0 0 0 0 -1">
      <site name="gel"/>
      <geom name="gel" type="box" size="0.0125 0.002 0.009" pos="-0.0075 -0.0063 0" solref="0.02 1"/>
    </body>
    <body name="body" pos="-0.0075 0 0.02">
      <freejoint/>
      <geom name="body" {geom} mass="0.06" friction="1 0.1 0.01" condim="6"/>
    </body>
  </worldbody>
</mujoco>
"""
CORNERS = " ".join(f"{x} {y} {z}" for x in (-4e-3, 4e-3) for y in (-3.5e-3, 3.5e-3) for z in (-2.5e-3, 2.5e-3))
GEOMS = {
    "sphere": 'type="sphere" size="0.006"',
    "box": 'type="box" size="0.006 0.005 0.004"',
    "cylinder": 'type="cylinder" size="0.005 0.004"',
    "capsule": 'type="capsule" size="0.004 0.004" euler="0 90 0"',
    "ellipsoid": 'type="ellipsoid" size="0.004 0.003 0.0025"',
    "mesh": 'type="mesh" mesh="star"',
}


def settled(geom: str):
    """The model and its state after a body has come to rest on the gel."""
    model = mujoco.MjModel.from_xml_string(LYING.format(geom=GEOMS[geom], vertices=CORNERS))
    data = mujoco.MjData(model)
    for _ in range(400):
        mujoco.mj_step(model, data)
        data.qvel[:] *= 0.98  # comes to rest sooner
    mujoco.mj_forward(model, data)
    return model, data


@pytest.mark.parametrize("geom", GEOMS)
def test_any_geom_presses_with_mujocos_force(geom):
    model, data = settled(geom)
    touch = MujocoGel(model, "gel", "gel")
    contact = touch(data)
    weight = 0.06 * 9.81  # N
    given = sum(touch.forces(data).values())
    assert given[1] == pytest.approx(weight, rel=0.1)  # nearly at rest
    assert contact.flags == ()
    assert contact.force[1] == pytest.approx(given[1], rel=5e-3)
    total = (contact.traction * touch.gel.areas[:, None]).sum(axis=0)
    np.testing.assert_allclose(total, contact.force, atol=0.01 * weight)
    centre = (np.abs(contact.traction[:, 1]) @ touch.gel.surface.rest[:, [0, 2]]) / np.abs(contact.traction[:, 1]).sum()
    own = data.geom("body").xpos[[0, 1]]  # the sensor's z is world y
    np.testing.assert_allclose(centre, own, atol=2.5e-3)  # m: the dome tilts what stands flat on MuJoCo's box


def test_nothing_touches_before_and_after():
    model = mujoco.MjModel.from_xml_string(LYING.format(geom=GEOMS["sphere"], vertices=CORNERS))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    touch = MujocoGel(model, "gel", "gel")
    assert touch(data) is None
    _, resting = settled("sphere")
    assert touch(resting).patch.any()
    assert not touch(data).patch.any()


def test_another_size_or_friction_counts_from_the_next_step():
    model, data = settled("sphere")
    touch = MujocoGel(model, "gel", "gel")
    small = touch(data)
    model.geom("body").size[0] = 9e-3  # as drawn anew for an episode
    touch.friction = 0.2
    wide = touch(data)
    assert touch.gel.indenter.radius == 9e-3 and touch.gel.friction == 0.2
    assert wide.patch.sum() > 1.1 * small.patch.sum()


def test_names_that_the_model_lacks_are_refused_with_those_it_has():
    model = mujoco.MjModel.from_xml_string(LYING.format(geom=GEOMS["sphere"], vertices=CORNERS))
    with pytest.raises(TactileError, match=r"no geom 'pad'.*floor, gel, body"):
        MujocoGel(model, "pad", "gel")
    with pytest.raises(TactileError, match="no site 'pad'"):
        MujocoGel(model, "gel", "pad")


def test_observations_lie_in_their_space():
    model, data = settled("sphere")
    touch = MujocoGel(model, "gel", "gel")
    touch(data)
    markers = marker_nodes(touch.gel)
    seen = observe(touch.gel, markers)
    space = observation_space(markers)
    assert space.contains(seen) and set(seen) == {"picture", "force", "markers"}
    assert np.abs(seen["markers"]).max() > 1e-6
    mini = Gel("gelsight_mini", Sphere(3e-3))
    places, camera = mini.surface.rest[marker_nodes(mini)], load_calibration(None, "gelsight_mini").camera
    assert np.ptp(places[..., 0]) == pytest.approx(0.8 * np.ptp(camera.gel_x), rel=0.1)  # over its own picture
    assert observation_space(markers, picture=False).contains(observe(touch.gel, markers, picture=False))


def no_display(*_):
    raise RuntimeError("nothing draws here")


def test_the_example_grasps(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(mujoco, "Renderer", no_display)
    grasp = module_at(EXAMPLE)
    frames = list(grasp.run(0.25, ("left",)))
    last = frames[-1]
    assert last["left"]["force"][1] == pytest.approx(last["left MuJoCo"][1], rel=5e-3)
    assert last["left MuJoCo"][1] > 0.5 and last["left flags"] == ()
    # The ball is about to hang between the fingers: what they bear along the surface is small against the friction.
    np.testing.assert_allclose(last["left"]["force"][[0, 2]], last["left MuJoCo"][[0, 2]], atol=0.05)
    assert grasp.main(["--seconds", "0.1", "--out", str(tmp_path), "--no-speed"]) == 0
    assert (tmp_path / "contact_sheet.png").read_bytes().startswith(b"\x89PNG")
    assert "10 frames" in capsys.readouterr().out
