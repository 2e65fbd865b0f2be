"""Add > Tactile: sensors and indenters."""

import bpy

from ...tactile_core import sensors
from ...tactile_core.geometry.indenters.indenter import forms
from ..objects import axes, biotac_objects, digit_body, digit_objects, indenter_objects
from ..operators import view
from ..operators.scene_bridge import sensor_of
from ..settings import properties, render_settings
from ..settings.reports import TactileOperator, require

# Each shape's own file says how the menu shows it, and which of the sizes below sets which of its fields.
FORMS = {kind: form for kind, form in forms().items() if form.label}
_ABOVE = 10e-3  # m over the sensors' frame: 1.7 mm above the pads, in the middle of both (docs/sources.md, Frame)
_MIDDLE = -8e-3  # m, x of the middle of the pads


class TACTILE_OT_add_sensor(TactileOperator):
    """Add a resting sensor"""

    bl_idname = "tactile.add_sensor"
    bl_label = "Add Sensor"

    sensor: bpy.props.EnumProperty(name="Sensor", description="Which sensor to add",
                                   items=lambda _self, _context: properties.sensor_items())  # fmt: skip
    millimetres: bpy.props.BoolProperty(
        name="Scene in Millimetres", description="Set the scene's unit to 1 mm; else its own unit is kept", default=True
    )

    def _work(self, context: bpy.types.Context) -> None:
        scene = context.scene
        name = self.sensor.lower()
        is_gel = sensors.is_gel(name)
        properties.check_absent(scene, name)
        view.hide_untouched(scene)
        if self.millimetres:
            view.use_millimetres(self, scene)
        group, per_metre = context.collection, axes.units_per_metre(scene)
        if is_gel:
            thing = digit_objects.add_gel(group, per_metre, properties.of_role(scene, "BIOTAC"), name)
            digit_body.add_body(thing, render_settings.calibration_of(scene, name))
        else:
            thing = biotac_objects.add_skin(group, per_metre, name)
            biotac_objects.add_core(group, thing)
            gel = properties.of_role(scene, "DIGIT")
            if gel is not None:
                thing.location = gel.location
                thing.location.y -= digit_objects.BESIDE * per_metre
        view.show(context, [thing])


class TACTILE_OT_add_indenter(TactileOperator):
    """Add an indenter over the middle of the sensor; move and keyframe it like any object"""

    bl_idname = "tactile.add_indenter"
    bl_label = "Add Indenter"

    shape: bpy.props.EnumProperty(
        name="Shape",
        description="What presses",
        items=[(kind, form.label, form.says) for kind, form in FORMS.items()],
        default="sphere",
    )
    radius: bpy.props.FloatProperty(
        name="Radius", description="Of the body or of the ring's middle, mm", default=3.0, min=0.5, max=20
    )
    tube: bpy.props.FloatProperty(name="Wire", description="Radius of the ring's wire, mm", default=1.0, min=0.2, max=5)
    edge: bpy.props.FloatProperty(
        name="Edge Radius", description="By which edges are rounded, mm", default=0.5, min=0.1, max=5
    )
    length: bpy.props.FloatProperty(
        name="Length", description="Of cylinder and edge; of the box's sides, mm", default=10.0, min=1, max=50
    )
    angle: bpy.props.FloatProperty(
        name="Angle", description="Between the flanks of the edge, degrees", default=60.0, min=10, max=170
    )

    def draw(self, _context: bpy.types.Context) -> None:
        """Draw only the sizes that the shape has."""
        self.layout.prop(self, "shape")
        for size in FORMS[self.shape].sizes.values():
            if size.slider:
                self.layout.prop(self, size.slider)

    def _work(self, context: bpy.types.Context) -> None:
        require("msgspec")
        import msgspec

        from ...tactile_core.simulation.indenter_specs import IndenterSpec

        sensor = sensor_of(context, context.object)
        sizes = {}
        for size in FORMS[self.shape].sizes.values():
            if size.slider:
                value = round(getattr(self, size.slider), 5)  # as typed: float32 makes 0.4 to 0.4000000059604645
                sizes[size.field] = value if size.count == 1 else [value] * size.count
        names = {thing.name for thing in context.scene.objects}
        name = next(n for n in (self.shape, *(f"{self.shape}_{k}" for k in range(2, 1000))) if n not in names)
        spec = msgspec.convert({"kind": self.shape, "name": name} | sizes, IndenterSpec)
        thing = indenter_objects.add_indenter(context.collection, spec, sensor.tactile.per_metre)
        thing.parent = sensor
        thing.location = (_MIDDLE * sensor.tactile.per_metre, 0, _ABOVE * sensor.tactile.per_metre)
        view.show(context, [thing], beside=[sensor])


class TACTILE_OT_use_as_indenter(TactileOperator):
    """Let the active mesh press, as it is: its modifiers, scale and rotation count"""

    bl_idname = "tactile.use_as_indenter"
    bl_label = "Use Mesh as Indenter"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Return true for a mesh that is no sensor."""
        thing = context.object
        if thing is None or thing.type != "MESH" or thing.tactile.role not in ("NONE", "INDENTER"):
            cls.poll_message_set("Select a mesh of your own")
            return False
        return True

    def _work(self, context: bpy.types.Context) -> None:
        thing = context.object
        sensor = sensor_of(context, thing)
        indenter_objects.check_pose(thing, indenter_objects.world_axes(thing, sensor))
        about = properties.set_up(thing, "INDENTER", sensor.tactile.per_metre)
        about.spec = ""


class TACTILE_MT_add(bpy.types.Menu):
    """Sensors and indenters"""

    bl_idname = "TACTILE_MT_add"
    bl_label = "Tactile"

    def draw(self, _context: bpy.types.Context) -> None:
        """Draw the menu; Blender calls it."""
        for name, label, _ in properties.sensor_items():
            self.layout.operator(TACTILE_OT_add_sensor.bl_idname, text=label, icon="OUTLINER_OB_META").sensor = name
        self.layout.separator()
        for kind, form in FORMS.items():
            self.layout.operator(TACTILE_OT_add_indenter.bl_idname, text=form.label, icon=form.icon).shape = kind
        self.layout.operator(TACTILE_OT_use_as_indenter.bl_idname, icon="MESH_MONKEY")


def _menu(menu: bpy.types.Menu, _context: bpy.types.Context) -> None:
    menu.layout.menu(TACTILE_MT_add.bl_idname, icon="HAND")


CLASSES = (TACTILE_OT_add_sensor, TACTILE_OT_add_indenter, TACTILE_OT_use_as_indenter, TACTILE_MT_add)
MENUS = ((bpy.types.VIEW3D_MT_add, _menu),)
