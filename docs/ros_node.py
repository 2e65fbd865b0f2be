"""A ROS 2 node: a BioTac driver's messages in, the DIGIT's picture and the force out.

Run it where rclpy and the driver's messages are installed, with this package beside them:

    python docs/ros_node.py --topic /hand/tactile --type biotac_sensors/msg/BioTacHand --finger 0

Publishes tactile/image (sensor_msgs/Image, rgb8) and tactile/wrench (geometry_msgs/WrenchStamped: the object's force,
N, in the sensor's frame; no torque is estimated) with the stamps of the messages, once the finger's rest is known.
"""

import argparse
import array
import importlib
import time
from typing import Any

import numpy as np

from tactile_core import TactileError
from tactile_core.jobs.convert import ToolOptions, load_tools
from tactile_core.jobs.frame_pass import Tools
from tactile_core.jobs.live import Shown, View
from tactile_core.recordings.assemble import assemble

# Message -> names of its list of fingers, and of a finger's electrodes and fluid pressure.
FIELDS = {
    "biotac_sensors/msg/BioTacHand": ("bt_data", "electrode_data", "pdc_data"),
    "sr_robot_msgs/msg/BiotacAll": ("tactiles", "electrodes", "pdc"),
}


class Finger:
    """A translator of one finger's messages to pictures; it knows nothing of ROS but the messages' fields.

    kind : a key of FIELDS; number : of the finger in its messages, from 0; tools : what `load_tools` returns
    """

    def __init__(self, kind: str, number: int, tools: Tools, rate: float = 100.0) -> None:
        self._kind, self._number = kind, number
        self.view = View(tools, rate)

    def __call__(self, message: Any) -> Shown | None:
        """Translate and draw a message; returns a `live.Shown`, None before rest is known. Raises TactileError."""
        came, (fingers, electrodes, pdc) = time.perf_counter(), FIELDS[self._kind]
        sensors = getattr(message, fingers)
        if self._number >= len(sensors):
            raise TactileError(
                self._kind, f"{len(sensors)} fingers", f"finger {self._number}", "Choose another --finger"
            )
        sensor = sensors[self._number]
        counts, pressure = np.array([getattr(sensor, electrodes)], float), np.array([getattr(sensor, pdc)], float)
        frame = assemble(self._kind, self._kind, electrodes=counts, stamps=np.zeros(1), pdc=pressure)
        return self.view.show(frame, came)


def picture_message(kind: type, header: Any, picture: np.ndarray) -> Any:
    """Build a sensor_msgs/Image of a picture (H, W, 3) uint8."""
    height, width, _ = picture.shape
    data = array.array("B", picture.tobytes())  # which rclpy takes as it is; of bytes it looks at each
    return kind(header=header, height=height, width=width, encoding="rgb8", step=3 * width, data=data)


def wrench_message(kind: type, header: Any, force: np.ndarray) -> Any:
    """Build a geometry_msgs/WrenchStamped of a force (3,) N."""
    message = kind(header=header)
    message.wrench.force.x, message.wrench.force.y, message.wrench.force.z = map(float, force)
    return message


def main() -> None:
    """Serve until Ctrl-C."""
    import rclpy
    from geometry_msgs.msg import WrenchStamped
    from rclpy.executors import ExternalShutdownException
    from rclpy.qos import QoSProfile, ReliabilityPolicy
    from sensor_msgs.msg import Image

    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--topic", required=True)
    parser.add_argument("--type", choices=FIELDS, default="biotac_sensors/msg/BioTacHand")
    parser.add_argument("--finger", type=int, default=0, metavar="N")
    parser.add_argument("--weights", metavar="DIR", help="networks of your own training")
    options, ros = parser.parse_known_args()
    rclpy.init(args=ros)
    node = rclpy.create_node("tactile")
    finger = Finger(options.type, options.finger, load_tools(ToolOptions(options.weights)))
    pictures = node.create_publisher(Image, "tactile/image", 1)
    forces = node.create_publisher(WrenchStamped, "tactile/wrench", 1)

    def take(message: Any) -> None:
        try:
            shown = finger(message)
        except TactileError as error:  # one bad message; the next may be whole
            node.get_logger().warning(str(error), throttle_duration_sec=5.0)
            return
        if shown is not None:
            pictures.publish(picture_message(Image, message.header, shown.picture))
            forces.publish(wrench_message(WrenchStamped, message.header, shown.force))

    package, _, name = options.type.partition("/msg/")
    kind = getattr(importlib.import_module(f"{package}.msg"), name)
    newest = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)  # what comes meanwhile is passed over
    node.create_subscription(kind, options.topic, take, newest)
    try:
        rclpy.spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        node.get_logger().info(finger.view.describe_latency())


if __name__ == "__main__":
    main()
