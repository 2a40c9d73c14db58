"""Datagrams on loopback."""

from __future__ import annotations

import socket

import pytest

from tactbench.links.link import UdpLink
from tactbench.plugin.devices import LinkTimeout


@pytest.fixture
def far():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as end:
        end.bind(("127.0.0.1", 0))
        end.settimeout(5.0)
        yield end


def test_datagrams_stay_whole_and_apart(far):
    with UdpLink("127.0.0.1", far.getsockname()[1]) as link:
        link.send(b"request")
        data, sender = far.recvfrom(100)
        assert data == b"request"
        for reply in (b"a" * 36, b"", b"b" * 60000):
            far.sendto(reply, sender)
            assert link.receive(5.0).data == reply


def test_only_the_peer_is_heard(far):
    with UdpLink("127.0.0.1", far.getsockname()[1]) as link:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
            stranger.sendto(b"stranger", ("127.0.0.1", link._socket.getsockname()[1]))
        far.sendto(b"peer", ("127.0.0.1", link._socket.getsockname()[1]))
        assert link.receive(5.0).data == b"peer"
        with pytest.raises(LinkTimeout):
            link.receive(0)
