"""Reads a log over HTTP ranges from `agglo view`, as viewers do, with Python's http.client and mcap.

usage: python view_check.py URL
"""

import http.client
import io
import sys
import urllib.parse

from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory


class Remote(io.RawIOBase):
    """A file on a server that knows ranges; never reads the whole."""

    def __init__(self, url):
        parts = urllib.parse.urlsplit(url)
        self.path, self.position, self.read_bytes = parts.path, 0, 0
        self.connection = http.client.HTTPConnection(parts.netloc)
        self.connection.request("HEAD", self.path)
        answer = self.connection.getresponse()
        answer.read()
        assert answer.status == 200 and answer.headers["accept-ranges"] == "bytes", answer.headers
        self.size = int(answer.headers["content-length"])

    def readable(self):
        return True

    def seekable(self):
        return True

    def seek(self, offset, whence=io.SEEK_SET):
        self.position = offset + {io.SEEK_SET: 0, io.SEEK_CUR: self.position, io.SEEK_END: self.size}[whence]
        return self.position

    def tell(self):
        return self.position

    def readinto(self, buffer):
        last = min(self.position + len(buffer), self.size) - 1
        if last < self.position:
            return 0
        self.connection.request("GET", self.path, headers={"Range": f"bytes={self.position}-{last}"})
        answer = self.connection.getresponse()
        data = answer.read()
        assert answer.status == 206, answer.status
        assert answer.headers["content-range"] == f"bytes {self.position}-{last}/{self.size}", answer.headers
        buffer[: len(data)] = data
        self.position += len(data)
        self.read_bytes += len(data)
        return len(data)


def main(url):
    remote = Remote(url)
    reader = make_reader(io.BufferedReader(remote, 65536), decoder_factories=[DecoderFactory()])
    summary = reader.get_summary()
    states = sum(1 for _ in reader.iter_decoded_messages(topics=["/particles"]))
    topics = {channel.id: channel.topic for channel in summary.channels.values()}
    counts = {topics[number]: count for number, count in summary.statistics.channel_message_counts.items()}
    assert states == counts["/particles"], (states, counts)
    print(f"{states} states in {remote.read_bytes} bytes of {remote.size}")


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    main(sys.argv[1])
