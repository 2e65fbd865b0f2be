"""The ROS 2 node of docs/, fed with a bag's messages by an rclpy that is made up here: none is installed with pip."""

import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace

import fake_tools
import numpy as np
import pytest
from by_path import module_at

pytest.importorskip("rosbags", reason="rosbags is absent: pip install tactile-core[ros]")

from bags import Topic, registered, write_bag

from tactile_core.errors import TactileError

NODE = Path(__file__).resolve().parents[3] / "docs" / "ros_node.py"


class Image(SimpleNamespace):
    pass


class WrenchStamped(SimpleNamespace):
    def __init__(self, header):
        super().__init__(header=header, wrench=SimpleNamespace(force=SimpleNamespace(x=0.0, y=0.0, z=0.0)))


class Node:
    """Keeps what is published and said; ``spin`` gives it the messages, then Ctrl-C."""

    def __init__(self, messages):
        self.messages, self.published, self.said = messages, {}, []

    def create_publisher(self, kind, topic, depth):
        return SimpleNamespace(publish=self.published.setdefault(topic, []).append)

    def create_subscription(self, kind, topic, take, profile):
        assert kind.__name__ == "BiotacAll" and topic == "/hand" and profile.depth == 1
        self.take = take

    def get_logger(self):
        return SimpleNamespace(warning=lambda text, **_: self.said.append(text), info=self.said.append)

    def spin(self, _node):
        for message in self.messages:
            self.take(message)
        raise KeyboardInterrupt


@pytest.fixture
def script():
    return module_at(NODE)


def a_press(frames: int) -> SimpleNamespace:
    """40 frames of rest, then counts that fall by one a frame and more; as ``write_bag`` wants them."""
    time = np.arange(frames) / 100
    fallen = np.clip(np.arange(frames) - 40, 0, None)
    counts = np.rint(np.linspace(3000, 3400, 19) - np.outer(fallen, np.linspace(1, 3, 19)))
    slow = {name: np.full(frames, 2000.0) for name in ("pdc", "tac", "tdc")}
    return SimpleNamespace(time=time, electrodes=counts, **slow)


def messages_of(press, folder, kind, finger):
    """Return a bag's messages as the library decodes them: objects with fields, as rclpy's."""
    from rosbags.rosbag2 import Reader

    write_bag(folder / "touch", press, "mcap", kind, finger=finger)
    name, store = registered(Topic("/biotac", kind, press), ros1=False)
    with Reader(folder / "touch") as reader:
        return [store.deserialize_cdr(data, name) for _, _, data in reader.messages()]


def install(monkeypatch, node):
    modules = {
        "rclpy": {"init": lambda args: None, "create_node": lambda name: node, "spin": node.spin},
        "rclpy.executors": {"ExternalShutdownException": type("ExternalShutdownException", (Exception,), {})},
        "rclpy.qos": {"QoSProfile": SimpleNamespace, "ReliabilityPolicy": SimpleNamespace(BEST_EFFORT=2)},
        "sensor_msgs.msg": {"Image": Image},
        "geometry_msgs.msg": {"WrenchStamped": WrenchStamped},
        "sr_robot_msgs.msg": {"BiotacAll": type("BiotacAll", (), {})},
    }
    for package in ("sensor_msgs", "geometry_msgs", "sr_robot_msgs"):
        modules[package] = {}
    for name, attributes in modules.items():
        module = ModuleType(name)
        vars(module).update(attributes)
        monkeypatch.setitem(sys.modules, name, module)


def test_messages_become_pictures_and_wrenches_and_a_bad_one_is_passed_over(script, tmp_path, monkeypatch):
    press = a_press(90)
    messages = messages_of(press, tmp_path, "all", 2)
    messages.insert(80, SimpleNamespace(header=None, tactiles=[]))
    node = Node(messages)
    install(monkeypatch, node)
    monkeypatch.setattr(script, "load_tools", lambda options: fake_tools.tools())
    words = ["ros_node.py", "--topic", "/hand", "--type", "sr_robot_msgs/msg/BiotacAll", "--finger", "2"]
    monkeypatch.setattr(sys, "argv", words)
    script.main()
    images, wrenches = node.published["tactile/image"], node.published["tactile/wrench"]
    assert 30 < len(images) == len(wrenches) < 90  # rest is known after 30 frames
    last = images[-1]
    assert last.header is wrenches[-1].header is messages[-1].header
    assert (last.height, last.width, last.encoding, last.step) == (*fake_tools.SHAPE, "rgb8", 3 * last.width)
    assert np.frombuffer(last.data, np.uint8).reshape(*fake_tools.SHAPE, 3)[0, -1, 0] > 10 + images[0].data[0]
    assert wrenches[-1].wrench.force.y > 0.1 > abs(wrenches[0].wrench.force.y)
    assert sum("0 fingers; expected finger 2" in text for text in node.said) == 1 and "ms from frame" in node.said[-1]


def test_the_hand_s_messages_are_read_as_its_bag_is(script, tmp_path):
    press = a_press(60)
    finger = script.Finger("biotac_sensors/msg/BioTacHand", 1, fake_tools.tools())
    for message in messages_of(press, tmp_path, "hand", 1):
        finger(message)
    assert finger.view.frames == 60 and finger.view.signals.found.startswith("frames")
    np.testing.assert_allclose(finger.view.signals.known.rest, press.electrodes[:30].mean(axis=0), atol=1.0)  # counts
    with pytest.raises(TactileError, match="2 fingers; expected finger 5"):
        script.Finger("biotac_sensors/msg/BioTacHand", 5, fake_tools.tools())(message)
