"""Decodes every message of a log with the Python packages mcap and mcap-protobuf-support, and checks what it finds.

usage: python mcap_check.py LOG
"""

import json
import struct
import sys

from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

FORMATS = {1: "B", 5: "I", 7: "f", 8: "d"}


def rows(cloud):
    """The points of a foxglove.PointCloud, as dictionaries."""
    for start in range(0, len(cloud.data), cloud.point_stride):
        yield {
            field.name: struct.unpack_from("<" + FORMATS[field.type], cloud.data, start + field.offset)[0]
            for field in cloud.fields
        }


def main(path):
    counts = {}
    with open(path, "rb") as stream:
        reader = make_reader(stream, validate_crcs=True, decoder_factories=[DecoderFactory()])
        scene = None
        for attachment in reader.iter_attachments():
            if attachment.name == "scene.json":
                scene = json.loads(attachment.data)
        run = next(record.metadata for record in reader.iter_metadata() if record.name == "run")
        assert run["log_format"].startswith("1."), run
        n = int(run["n"])
        scale = scene["record"]["time_scale"]
        last_time = 0
        for schema, channel, message, decoded in reader.iter_decoded_messages():
            topic = channel.topic
            assert decoded.DESCRIPTOR.full_name == schema.name, (topic, schema.name)
            if not counts:
                assert topic == "/particles/static", f"the first message is on {topic}"
            counts[topic] = counts.get(topic, 0) + 1
            assert message.sequence == counts[topic] - 1, f"{topic}: sequence {message.sequence}"
            assert message.log_time == message.publish_time == round(decoded.t * scale * 1e9), topic
            assert message.log_time >= last_time, f"{topic} goes back in time"
            last_time = message.log_time
            if topic == "/particles/static":
                assert len(decoded.id) == len(decoded.radius) == len(decoded.mass) == n
                radii, mass = list(decoded.radius), sum(decoded.mass)
            elif topic == "/particles":
                points = list(rows(decoded))
                assert len(points) == n and decoded.frame_id == "world"
                assert ("temperature" in points[0]) == ("thermal" in scene)
                assert ("cluster" in points[0]) == ("binding" in scene or "clusters" in scene)
            elif topic == "/scene":
                spheres = next(entity for entity in decoded.entities if entity.id == "particles").spheres
                assert [sphere.size.x / 2 for sphere in spheres] == radii
                assert all(sphere.pose.orientation.w == 1 and sphere.color.a == 1 for sphere in spheres)
                # The spheres stand where the last state says, to a hundred-thousandth, in the colour that it says, to a 64th.
                for sphere, point in zip(spheres, points, strict=True):
                    assert abs(sphere.pose.position.x - point["x"]) <= 1e-5 * abs(point["x"])
                    assert abs(sphere.color.r - point["red"] / 255) <= 1 / 64 and point["alpha"] == 255
            elif topic == "/energy":
                # Sums of a few numbers in another order: round-off.
                assert abs(decoded.kinetic_per_mass * mass - decoded.kinetic) <= 1e-12 * abs(decoded.kinetic)
                assert decoded.HasField("mean_temperature") == decoded.HasField("max_temperature") == ("thermal" in scene)
                if "thermal" in scene:
                    temperatures = [point["temperature"] for point in points]
                    assert decoded.max_temperature == max(temperatures)
                    assert abs(decoded.mean_temperature * n - sum(temperatures)) <= 1e-12 * n * decoded.max_temperature
            elif topic == "/diagnostics":
                assert decoded.iterations == len(decoded.position_errors) and decoded.dt > 0
            elif topic == "/impacts":
                assert decoded.events and all(event.WhichOneof("partner") for event in decoded.events)
        statistics = reader.get_summary().statistics
        assert statistics.message_count == sum(counts.values()), statistics
    print(f"{counts['/particles']} states, {sum(counts.values())} messages on {len(counts)} channels")


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    main(sys.argv[1])
