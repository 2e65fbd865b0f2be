"""Define what the add-on stores with each object: its role, a key of ROLES ("BIOTAC": any skin, "DIGIT": any gel), and
how its recording was read."""

import functools
import math
from collections.abc import Callable

import bpy

from ...tactile_core import sensors
from ...tactile_core.errors import TactileError
from ...tactile_core.geometry.lattice import Lattice
from ...tactile_core.mechanics.placement import FRICTION
from ...tactile_core.sensors import descriptor

FORMAT = 2  # of these properties; raised when an older file needs to be read differently. 2: friction and tilt

# Blender 4.5 asks for this word before it lets a path begin with "//"; older ones do not know it.
RELATIVE = {"PATH_SUPPORTS_BLEND_RELATIVE"} if bpy.app.version >= (4, 5, 0) else set()

ROLES = (
    ("NONE", "None", "Nothing of this add-on"),
    # The names of files of former versions, of any sensor of skin and fluid, and of any gel.
    ("BIOTAC", "Skin", "The skin of an imported or simulated sensor of skin and fluid, as the BioTac"),
    ("DIGIT", "Gel", "The gel of a translated or simulated sensor, as the DIGIT"),
    ("CORE", "Core", "The rigid core under the skin"),
    ("ELECTRODE", "Electrode", "A marker of one electrode"),
    ("INDENTER", "Indenter", "A body that presses"),
    ("LED", "LED", "A lamp of a gel's sensor"),
    ("BODY", "Body", "A part of a gel's sensor that is there to be seen"),
    ("TWIN", "Simulated indenter", "Where the simulation had the indenter"),
    ("LEGEND", "Legend", "A colour bar, an arrow, or a light to look by"),
)
PRESS_BY = (
    ("HEIGHT", "Height", "It presses as deep as it is moved into the gel"),
    ("FORCE", "Force", "It presses with the keyframed force, wherever its height is"),
)
MOTIONS = (  # numbers as in files of before: 1 was compact keys
    ("SHAPE_KEYS", "Shape Keys", "One shape key a frame along one curve: exact, and fast to play", "", 0),
    ("MESH_CACHE", "Mesh Cache", "A PC2 file beside the .blend: for recordings of thousands of frames", "", 2),
)


OF_ROLE = {"BIOTAC": sensors.SOURCE, "DIGIT": sensors.TARGET}  # the sensors of objects that name none
POLARITIES = (
    ("auto", "Automatic", "As the file says, or the recording shows"),
    ("falls", "Falls", "Counts fall, as raw readings of a BioTac do"),
    ("rises", "Rises", "Counts rise: the file holds rest minus reading"),
)


class RecordingOptions:
    """Settings by which a recording is read and translated; the importing operator and the imported skin have them."""

    tare: bpy.props.StringProperty(
        name="Tare", description="Frames without contact as A:B, auto to find them, none to keep the file's own zero",
        default="auto",
    )  # fmt: skip
    polarity: bpy.props.EnumProperty(
        name="Polarity", description="What the electrodes' counts do where the film over them thins", items=POLARITIES
    )
    frames: bpy.props.StringProperty(
        name="Frames", description="Part of the recording, A:B:STEP as in Python; a colon alone takes all", default=":"
    )
    columns: bpy.props.StringProperty(
        name="Columns", description="Map that says which column or array of the recording is what, where no layout is"
        " known; one that is not there is written, guessed, to be checked", subtype="FILE_PATH", options=RELATIVE,
    )  # fmt: skip
    unit: bpy.props.StringProperty(
        name="Unit", description="Rest and gains of the recording's own finger, a file of `tactile adapt`; empty: a"
        " typical finger's", subtype="FILE_PATH", options=RELATIVE,
    )  # fmt: skip
    apart: bpy.props.BoolProperty(
        name="Each Frame Alone", description="Translate each frame by its own signals, as snapshots without order need;"
        " else the contact is followed through the frames", options=set(),
    )  # fmt: skip
    two: bpy.props.BoolProperty(
        name="Two Contacts", description="Look for a second contact in each frame, of a finger that touches in two"
        " places; a single wide contact is often taken for two", options=set(),
    )  # fmt: skip
    ball: bpy.props.FloatProperty(
        name="Known Ball (mm)", description="Diameter of the ball that is known to have touched, 2000: a plate; 0 if"
        " it is not known. Translate then solves the gel under it", soft_min=0.0, soft_max=2000.0, options=set(),
    )  # fmt: skip
    weights: bpy.props.StringProperty(
        name="Weights", description="Folder of the networks, which name their two sensors; empty: those that ship for"
        " the recording's sensor", subtype="DIR_PATH", options=RELATIVE,
    )  # fmt: skip


class TactileObject(RecordingOptions, bpy.types.PropertyGroup):
    """Properties that the add-on stores with each object: its role, its sensor, and how its recording was read."""

    role: bpy.props.EnumProperty(name="Role", description="What this object is to the Tactile add-on", items=ROLES)
    format: bpy.props.IntProperty(name="Format", description="Of these properties, to tell older files", default=0)
    per_metre: bpy.props.FloatProperty(name="Units a Metre", description="Blender units a metre", default=1000.0)
    recording: bpy.props.StringProperty(
        name="Recording", description="The file this was imported from", subtype="FILE_PATH", options=RELATIVE,
        update=lambda about, _context: setattr(about, "folder", bpy.path.abspath("//")),
    )  # fmt: skip
    folder: bpy.props.StringProperty(name="Folder", description="Of the .blend, from which relative paths start")
    known: bpy.props.StringProperty(name="Known", description="What the recording was read with of its unit, in words")
    sensor: bpy.props.StringProperty(name="Sensor", description="Whose skin or gel it is, as its descriptor is named")
    motion: bpy.props.EnumProperty(name="Motion", description="How the mesh is animated", items=MOTIONS)
    colour: bpy.props.StringProperty(name="Colour", description="Which LED of the calibration this is")
    spec: bpy.props.StringProperty(
        name="Shape", description="An indenter's kind and sizes, as in a scene file; empty: the object's own mesh"
    )
    document: bpy.props.StringProperty(
        name="Document", description="What else the scene file held that this indenter came from"
    )
    press_by: bpy.props.EnumProperty(
        name="Press by", description="What says how hard the indenter presses", items=PRESS_BY
    )
    force: bpy.props.FloatProperty(
        name="Force", description="Force of the press, in newtons; keyframe it like a location", min=0.0, soft_max=2.0,
        default=0.0, precision=3, options={"ANIMATABLE"},
    )  # fmt: skip
    friction: bpy.props.FloatProperty(
        name="Friction", description="Coefficient of friction between the indenter and the gel", default=FRICTION,
        min=0.0, max=5.0, options=set(),
    )  # fmt: skip
    tilt: bpy.props.FloatProperty(
        name="Tilt", description="Of the press against the normal of the surface", subtype="ANGLE",
        default=0.0, min=0.0, max=math.radians(45), options=set(),
    )  # fmt: skip
    object_reflectance: bpy.props.FloatProperty(
        name="Object Reflectance", description="Of what touches this gel, to 1, white: it shows through the coating in"
        " pictures of this engine. 0: the calibration's", min=0.0, max=1.0, default=0.0, options={"ANIMATABLE"},
        update=lambda about, _context: about.id_data.update_tag(),  # else Blender takes no notice
    )  # fmt: skip
    calibrated: bpy.props.StringProperty(name="Calibrated", description="Which unit this gel's LEDs and camera are of")
    picture: bpy.props.PointerProperty(name="Picture", description="Of this gel", type=bpy.types.Image)
    heights: bpy.props.PointerProperty(name="Height Map", description="Of this gel, mm", type=bpy.types.Image)
    largest: bpy.props.FloatProperty(
        name="Largest", description="Largest displacement of the animation, metres", default=0.0, min=0.0
    )
    first_frame: bpy.props.IntProperty(name="First Frame", description="Scene frame of the recording's first frame")
    samples: bpy.props.FloatProperty(
        name="Samples a Frame", description="Frames of a recording simulated here that one of the scene takes",
        default=1.0, min=1e-3,
    )  # fmt: skip


def set_up(thing: bpy.types.Object, role: str, per_metre: float, sensor: str = "") -> TactileObject:
    """Set an object's role and, for a skin or gel, its sensor; return its properties. per_metre : units in a metre"""
    about = thing.tactile
    about.role, about.per_metre, about.sensor, about.format = role, per_metre, sensor, FORMAT
    return about


def set_up_part(thing: bpy.types.Object, parent: bpy.types.Object, role: str) -> None:
    """Give an object a role, and make it a child of ``parent``, shown in the same collection."""
    set_up(thing, role, parent.tactile.per_metre)
    home = home_of(parent)
    free = home.library is None and home.override_library is None
    (home if free else parent.users_scene[0].collection).objects.link(thing)
    thing.parent = parent


def sensor_name(thing: bpy.types.Object) -> str:
    """Return the sensor of a skin or a gel. An object of an older version names none: it is a BioTac or a DIGIT."""
    return thing.tactile.sensor or OF_ROLE[thing.tactile.role]


def surface_of(thing: bpy.types.Object) -> Lattice:
    """Return the resting surface of a skin or a gel. Raises TactileError for a sensor that is not known here."""
    return sensors.sensor_surface(sensor_name(thing))


def sensor_items(gels_only: bool = False) -> list[tuple[str, str, str]]:
    """List the sensors with a descriptor as a menu's items, BioTac and DIGIT first. gels_only : leaves others out"""
    return _items(descriptor.names(), gels_only)


@functools.cache  # Blender needs the texts to live on
def _items(names: tuple[str, ...], gels_only: bool) -> list[tuple[str, str, str]]:
    found = []
    for name in sorted(names, key=lambda name: (name not in sensors.PAIR, name)):
        try:
            gel, title = sensors.is_gel(name), sensors.title(name)
        except TactileError:  # a descriptor of the user's own that is wrong; `tactile info --sensor` says what
            continue
        if gel or not gels_only:
            found.append((name.upper(), title, f"{title}: {'a gel' if gel else 'skin and fluid'}"))
    return found


def of_role(scene: bpy.types.Scene, role: str, near: bpy.types.Object | None = None) -> bpy.types.Object | None:
    """Return an object of a role: ``near`` itself, the nearest in its collections, the scene's first, or None."""
    return _beside(scene, role, near) or next((thing for thing in scene.objects if thing.tactile.role == role), None)


def _beside(scene: bpy.types.Scene, role: str, near: bpy.types.Object | None) -> bpy.types.Object | None:
    beside = [near, *(thing for group in near.users_collection for thing in group.objects)] if near is not None else ()
    found = min((thing for thing in beside if thing.tactile.role == role), default=None,
                key=lambda thing: (thing.matrix_world.translation - near.matrix_world.translation).length)  # fmt: skip
    return found if found is not None and scene.objects.get(found.name) is not None else None


def found_again(scene: bpy.types.Scene, uid: int, was: str, what: str) -> bpy.types.Object:
    """Return the object with a ``session_uid``, even if it was renamed. Raises TactileError if the scene has it no
    longer. was, what : its former name, and what it was, for the message"""
    found = next((thing for thing in scene.objects if thing.session_uid == uid), None)
    if found is None:
        raise TactileError(was, "no longer in the scene", what)
    return found


def gel_of(scene: bpy.types.Scene, near: bpy.types.Object | None = None) -> bpy.types.Object | None:
    """Return ``near`` or a gel in its collections, else that of the scene's camera, else the first, else None."""
    seen = scene.camera
    while seen is not None and seen.tactile.role != "DIGIT":  # an empty may stand between
        seen = seen.parent
    seen = seen if seen is not None and seen.name in scene.objects else None
    return _beside(scene, "DIGIT", near) or seen or of_role(scene, "DIGIT")


def needed_gel(scene: bpy.types.Scene, near: bpy.types.Object | None = None) -> bpy.types.Object:
    """Return the gel that ``gel_of`` finds. Raises TactileError if the scene has none, or only an instance of one."""
    gel = gel_of(scene, near)
    if gel is not None:
        return gel
    for thing in scene.objects:
        held = thing.instance_collection
        if held is not None and any(part.tactile.role == "DIGIT" for part in held.all_objects):
            advice = f"Drag the collection {held.name} into the scene in place of its instance"
            raise TactileError(thing.name, "an instance of a gel", "a gel of the scene's own", advice)
    raise TactileError(scene.name, "there is no DIGIT", "a gel to look at", "Translate a recording, or add a DIGIT")


def can(kind: type[bpy.types.Operator], need: Callable[[], object]) -> bool:
    """Return true if ``need()`` raises no TactileError; else show its text as why the button of ``kind`` is grey."""
    try:
        need()
    except TactileError as error:
        kind.poll_message_set(str(error))
        return False
    return True


def home_of(thing: bpy.types.Object) -> bpy.types.Collection:
    """Return an object's first collection that is in a scene: those that Blender makes to link light are in none."""
    shown = {group for scene in bpy.data.scenes for group in (scene.collection, *scene.collection.children_recursive)}
    return next((group for group in thing.users_collection if group in shown), thing.users_collection[0])


def rendered(layer: bpy.types.ViewLayer, depsgraph: bpy.types.Depsgraph | None = None) -> set[bpy.types.Object]:
    """Return a view layer's objects that renders show: neither they nor all of their collections are hidden in renders.
    depsgraph : says which are hidden on the frame that it is of; None for the frame in the window"""
    found, groups = set(), [layer.layer_collection]
    for group in groups:
        if not group.collection.hide_render:
            groups += group.children
            held = () if group.exclude else group.collection.objects
            found.update(t for t in held if not (t.evaluated_get(depsgraph) if depsgraph else t).hide_render)
    return found


def check_format(thing: bpy.types.Object) -> None:
    """Raise TactileError for an object that a newer version of the add-on made."""
    if thing.tactile.format > FORMAT:
        raise TactileError(
            thing.name, f"made by a newer version of the add-on (format {thing.tactile.format})",
            f"format {FORMAT} or older", "Update the add-on",
        )  # fmt: skip


def check_own(*things: bpy.types.ID | None) -> None:
    """Raise TactileError for an object or its data linked from another .blend: Blender lets no one change it here."""
    for thing in things:
        if thing is not None and thing.library is not None:
            raise TactileError(
                thing.name, f"linked from {thing.library.name}", "one of this file, which can be changed",
                "Append it in place of linking: a library override can be moved and styled; its lights cannot change",
            )  # fmt: skip


def check_absent(scene: bpy.types.Scene, *names: str) -> None:
    """Raise TactileError if a scene already has one of the sensors ``names``: of two, either could be meant."""
    for thing in scene.objects:
        if thing.tactile.role in OF_ROLE and sensor_name(thing) in names:
            found, advice = f"already in the scene, as {thing.name}", "Use a scene for each pair"
            raise TactileError(sensor_name(thing).upper(), found, "one of each sensor", advice)


CLASSES = (TactileObject,)
POINTERS = ((bpy.types.Object, "tactile", TactileObject),)
