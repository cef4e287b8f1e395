"""Watches a run over Foxglove's websocket protocol with the Python package websockets, and checks what comes.

usage: python live_check.py PORT        (start it first: it waits for `agglo run .. --live=127.0.0.1:PORT`)

Three clients: one reads all, one joins late, one subscribes and never reads.
"""

import base64
import json
import struct
import sys
import threading
import time

from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

STATES_BEFORE_THE_LATE = 20


def decoder(channel):
    """The message class that a channel's embedded schema describes."""
    files = descriptor_pb2.FileDescriptorSet.FromString(base64.b64decode(channel["schema"]))
    pool = descriptor_pool.DescriptorPool()
    for file in files.file:
        pool.Add(file)
    return message_factory.GetMessageClass(pool.FindMessageTypeByName(channel["schemaName"]))


class Viewer:
    """A client that has subscribed to every channel."""

    def __init__(self, port, patience=60.0):
        deadline = time.monotonic() + patience
        while True:
            try:
                # Small buffers, so that a client that does not read is felt by the server soon.
                # Entered and never left: the process ends with it.
                self.socket = connect(
                    f"ws://127.0.0.1:{port}", subprotocols=["foxglove.sdk.v1"], max_size=None, max_queue=4
                ).__enter__()
                break
            except OSError:
                assert time.monotonic() < deadline, "nobody serves"
                time.sleep(0.005)
        self.info = json.loads(self.socket.recv(timeout=20))
        assert self.info["op"] == "serverInfo", self.info
        self.channels, self.statuses = {}, []
        while "/log" not in {channel["topic"] for channel in self.channels.values()}:
            message = self.socket.recv(timeout=20)
            if isinstance(message, bytes):
                assert message[0] == 2, "nothing but the time before it is asked for"
                continue
            message = json.loads(message)
            assert message["op"] == "advertise", message
            self.channels |= {channel["id"]: channel for channel in message["channels"]}
        self.classes = {number: decoder(channel) for number, channel in self.channels.items()}
        asked = [{"id": number, "channelId": number} for number in self.channels]
        self.socket.send(json.dumps({"op": "subscribe", "subscriptions": asked}))

    def messages(self):
        """(topic, log time, decoded message); ("time", ns, None) for broadcasts of the time."""
        while True:
            try:
                message = self.socket.recv(timeout=60)
            except ConnectionClosed:
                return
            if isinstance(message, str):
                self.statuses.append(json.loads(message))
            elif message[0] == 1:
                number, log_time = struct.unpack_from("<IQ", message, 1)
                yield self.channels[number]["topic"], log_time, self.classes[number].FromString(message[13:])
            elif message[0] == 2:
                yield "time", struct.unpack_from("<Q", message, 1)[0], None
            else:
                raise AssertionError(f"a message of kind {message[0]}")


def late(port, after, result):
    """Joins while the run is under way, and must be told what the state is."""
    viewer = Viewer(port)
    first = {}
    for topic, _, message in viewer.messages():
        if message is not None:
            first.setdefault(topic, message)
        if "/particles" in first and "/particles/static" in first:
            break
    result["late"] = first["/particles"].step if "/particles" in first else None
    assert first["/particles/static"].radius and first["/particles"].step >= after, "the late viewer is told the past"
    viewer.socket.close()


def main(port):
    viewer = Viewer(port)
    assert viewer.info["capabilities"] == ["time"], viewer.info
    # It must not take anything from us: neither a channel nor a message on one.
    channel = {"id": 7, "topic": "/particles", "encoding": "json", "schemaName": "evil"}
    viewer.socket.send(json.dumps({"op": "advertise", "channels": [channel]}))
    viewer.socket.send(struct.pack("<BI", 1, 7) + b"{}")
    sleeper = Viewer(port)

    counts, last, times, joined, result = {}, {}, [], None, {}
    for topic, log_time, message in viewer.messages():
        counts[topic] = counts.get(topic, 0) + 1
        if message is None:
            times.append(log_time)
            continue
        assert message.step >= last.get(topic, -1), f"{topic}: step {message.step} after {last[topic]}"
        last[topic] = message.step
        assert log_time == round(message.t * 1e9), f"{topic}: {log_time} at t = {message.t}"
        if topic == "/particles" and counts[topic] == STATES_BEFORE_THE_LATE:
            joined = threading.Thread(target=late, args=(port, message.step, result))
            joined.start()
    assert joined, f"only {counts} came"
    joined.join()
    assert result.get("late") is not None, "nobody told the late viewer"
    assert times == sorted(times) and len(times) >= 2, "the time goes forward"
    expected = {channel["topic"] for channel in viewer.channels.values()} - {"/log", "/impacts"}
    assert expected <= set(counts), f"nothing on {expected - set(counts)}"
    refused = [status for status in viewer.statuses if status.get("op") == "status" and status.get("level", 0) >= 1]
    assert refused, f"publishing was not refused: {viewer.statuses}"
    sleeper.socket.close()
    print(f"{counts['/particles']} states up to step {last['/particles']} on {len(viewer.channels)} channels, "
          f"{len(times)} times, late viewer at step {result['late']}")


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    main(int(sys.argv[1]))
