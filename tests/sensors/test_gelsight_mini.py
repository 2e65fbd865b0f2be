"""The GelSight Mini by its descriptor: the public mesh's nodes, its camera and its calibration."""

from contextlib import nullcontext

import numpy as np
import pytest
from PIL import Image

from tactile_core import sensors
from tactile_core.errors import TactileError
from tactile_core.geometry.indenters import Sphere
from tactile_core.jobs.gel import Gel
from tactile_core.jobs.render import Options, render
from tactile_core.pictures.background import read_photograph
from tactile_core.pictures.calibrate.ball_pictures import FastPictures
from tactile_core.pictures.calibrate.evaluate import evaluate_unit
from tactile_core.pictures.calibrate.photographs import read_photographs
from tactile_core.pictures.height_map import of_unit, rest_height_map
from tactile_core.pictures.renderer import Renderer
from tactile_core.sensors.about import about
from tactile_core.sensors.calibration_file import calibration_path, load_calibration
from tactile_core.simulation import tier_choice
from tactile_core.translation import gel_place
from tactile_core.translation.contact_frame import frame_of

NAME = "gelsight_mini"
# Nodes of the public mesh (docs/sources.md, GelSight Mini gel): mm from its middle, along the short and the long side,
# and height over the back.
APEX, DOME = (0.0, 0.0, 4.0), [(4.5, 6.0, 3.8395), (7.5354, 0.0, 3.75), (7.5354, 9.7165, 3.6760), (0.0, 3.0, 3.9764)]
EDGE = [(8.7336, 0.0, 3.5379), (9.3083, 0.0, 3.3350), (0.0, 11.125, 3.4625)]


@pytest.mark.parametrize(("nodes", "within"), [([APEX], 1e-7), (DOME, 3e-6), (EDGE, 40e-6)])
def test_the_surface_passes_through_nodes_of_the_public_mesh(nodes, within):
    x, z, height = 1e-3 * np.array(nodes).T
    for side in (-1, 1):
        found = sensors.shape_of(NAME).dome_height(-8e-3 + side * x, side * z)
        np.testing.assert_allclose(found, height, atol=within)


def test_its_lowest_point_is_the_biotac_s():
    lowest = sensors.sensor_surface(NAME).rest[:, 1].min()
    assert lowest == pytest.approx(load_calibration(None, NAME).camera.height_zero_y, abs=2e-6)
    assert lowest == pytest.approx(sensors.biotac_surface().rest[:, 1].min(), abs=10e-6)


def test_a_sensor_is_told_in_words():
    words = about(NAME)
    assert "gelsight_mini: GelSight Mini\nkind: gel, domed, 4 mm thick" in words and "source: FEATS" in words
    assert "kind: fluid, a skin 1.58 mm thick" in about("biotac")
    with pytest.raises(TactileError, match="expected biotac, biotac_sp, digit, gelsight_mini"):
        about("gelsight")


def test_a_scene_is_simulated_and_drawn_on_it(request, tmp_path, coarse_mini):
    """`tactile render SCENE --gel gelsight_mini`: the scene's presses of its gel, seen by its camera."""
    scene = request.config.rootpath / "scenes/press"
    text = (scene / "scene.toml").read_text(encoding="utf-8")
    (tmp_path / "scene.toml").write_text(text, encoding="utf-8")
    unit = calibration_path(coarse_mini)
    options = Options(preset="fast", calibration=unit, size=(80, 60), frames=slice(0, 101, 100))
    folder = render(
        tmp_path / "scene.toml", tmp_path / "out", options, lambda word: nullcontext(lambda done, total: None)
    )
    rest, pressed = (np.asarray(Image.open(folder / "images" / f"{k:05d}.png")).astype(int) for k in (0, 100))
    assert rest.shape == (60, 80, 3)
    assert np.abs(pressed - rest).max() > 30


def test_a_gel_is_drawn_by_its_own_camera_alone(coarse_mini):
    gel = Gel(coarse_mini, Sphere(3e-3))
    gel.press(gel.touching(-8e-3, 0.0, 0.3e-3))
    assert gel.picture().shape == (*load_calibration(None, coarse_mini).camera.shape, 3)
    with pytest.raises(TactileError, match="calibration: of a DIGIT; expected one of a Coarse Mini"):
        Gel(coarse_mini, Sphere(3e-3), calibration=load_calibration())


def test_a_calibration_of_another_gel_is_refused(tmp_path):
    with pytest.raises(TactileError, match="'digit'; expected 'gelsight_mini'"):
        load_calibration(calibration_path("digit"), NAME)


def test_a_ball_presses_the_dome_of_its_descriptor():
    unit = load_calibration(None, NAME).at_size(80, 60)
    bench = FastPictures(unit)
    np.testing.assert_allclose(bench.rest, of_unit(rest_height_map(unit.camera), unit), atol=3e-6)
    assert bench.deepest(0.75e-3) / 0.75e-3 > bench.deepest(3e-3) / 3e-3  # small balls are pressed deeper


def test_its_channels_are_those_of_real_photographs(outside_data):
    """A resting picture is teal, red lights the top; red and blue exchanged, it is 22.3 levels off the real unit's."""
    photograph = read_photograph(outside_data(NAME) / "background.png").astype(float)
    unit = load_calibration(None, NAME)
    rest = Renderer(unit, "fast")(rest_height_map(unit.camera)).astype(float)
    even = np.abs(photograph - photograph.mean((0, 1))).mean()  # 18.4
    assert np.abs(rest - photograph).mean() < even / 3  # another unit than the calibration's; measured: 4.7
    whole = read_photographs(outside_data(NAME), outside_data(NAME) / "background.png")
    (tried,) = evaluate_unit(unit, whole, 3e-3, search_radius=False)  # the ball's size is not published
    assert tried.metrics["roi_l1"] < 0.7 * tried.baseline["roi_l1"]  # measured: 3.7 of 5.9; exchanged, 5.9


def test_red_lights_the_top_of_a_print_and_the_gel_rests_teal():
    unit = load_calibration(None, NAME).at_size(80, 60)
    red, green, blue = Renderer(unit, "fast")(rest_height_map(unit.camera)).mean((0, 1))
    assert red < green and red < blue
    change = FastPictures(unit).change((0.0, 0.0, 0.5e-3, 3e-3))
    top, bottom = change[20:30].mean((0, 1)), change[30:40].mean((0, 1))
    assert top[0] > bottom[0] and top[2] < bottom[2]


def test_places_of_a_latent_lie_on_its_own_gel():
    frame = frame_of(NAME, 4)
    point = np.array([[-8e-3, 0.0], [-4e-3, 8e-3]])
    np.testing.assert_allclose(gel_place.on_gel(frame, gel_place.place_on(frame, point)), point, atol=1e-6)


def test_tiers_of_a_gel_that_were_not_measured_are_not_chosen():
    with pytest.raises(TactileError, match="no errors are measured on the GelSight Mini"):
        tier_choice.choose(NAME, 0.2, 50.0)
