"""Read the frames that `tactile watch touch.csv --serve 7311` serves: python docs/read_frames.py 7311"""

import json
import sys

import numpy as np
import zmq

reader = zmq.Context().socket(zmq.SUB)
reader.setsockopt(zmq.CONFLATE, 1)  # the newest frame alone, however slow this program is
reader.setsockopt(zmq.SUBSCRIBE, b"")
reader.connect(f"tcp://127.0.0.1:{sys.argv[1]}")
while True:
    header, _, raw = reader.recv().partition(b"\n")
    frame, arrays = json.loads(header), {}
    for name, dtype, shape in frame["arrays"]:
        arrays[name] = np.frombuffer(raw, dtype, count=np.prod(shape, dtype=int)).reshape(shape)
        raw = raw[arrays[name].nbytes :]
    print(
        frame["frame"], frame["force_n"], frame["confidence"], arrays["picture"].mean(axis=(0, 1)), flush=True
    )  # levels of red, green, blue
