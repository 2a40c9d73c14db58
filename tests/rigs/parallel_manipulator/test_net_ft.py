"""Raw data transfer of a Net F/T box: golden vectors, order of datagrams, and the emulated box over a real socket."""

import http.server
import socket
import threading
import time
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tactbench.plugin import Quality, UsageError
from tactbench.rigs.parallel_manipulator.force_torque.ati_xml import AtiFileError
from tactbench.rigs.parallel_manipulator.force_torque.net_ft.codec import (
    CONFIGURATION_PATH,
    MOST_BUFFERED,
    RESTART_RUN,
    Command,
    CountScale,
    DatagramError,
    Health,
    Record,
    RecordReader,
    Request,
    Status,
    Step,
    decode_buffer,
    decode_record,
    decode_request,
    encode_record,
    encode_request,
    health,
    quality,
    read_configuration,
    step,
)
from tactbench.rigs.parallel_manipulator.force_torque.net_ft.emulator import DatagramFault, RdtEmulator

REQUESTS = [
    ("12 34 00 00 00 00 00 00", Request(Command.STOP)),
    ("12 34 00 02 00 00 00 00", Request(Command.START_REALTIME)),
    ("12 34 00 02 00 00 00 01", Request(Command.START_REALTIME, 1)),
    ("12 34 00 02 00 00 00 0A", Request(Command.START_REALTIME, 10)),
    ("12 34 00 02 00 00 03 E8", Request(Command.START_REALTIME, 1000)),
    ("12 34 00 02 FF FF FF FF", Request(Command.START_REALTIME, 0xFFFFFFFF)),
    ("12 34 00 03 00 00 00 00", Request(Command.START_BUFFERED)),
    ("12 34 00 03 00 00 00 64", Request(Command.START_BUFFERED, 100)),
    ("12 34 00 41 00 00 00 00", Request(Command.RESET_CONDITION_LATCH)),
    ("12 34 00 42 00 00 00 00", Request(Command.SET_SOFTWARE_BIAS)),
]
ZERO = " ".join(["00"] * 24)
# AT-2: bytes, sequences, status, values by 1e6 counts per unit, health.
RECORDS = [
    (f"00 00 00 01 00 00 00 01 00 00 00 00 {ZERO}", 1, 1, 0, [0] * 6, Health.HEALTHY),
    (f"00 00 00 02 00 00 00 08 00 00 00 00 00 0F 42 40 {ZERO[:59]}", 2, 8, 0, [1, 0, 0, 0, 0, 0], Health.HEALTHY),
    (
        f"00 00 00 03 00 00 00 0F 00 00 00 00 00 00 00 00 FF F0 BD C0 {ZERO[:47]}",
        3, 15, 0, [0, -1, 0, 0, 0, 0], Health.HEALTHY,
    ),
    (
        f"00 00 00 04 00 00 00 16 00 00 00 00 {ZERO[:23]} FF D9 DA 60 {ZERO[:35]}",
        4, 22, 0, [0, 0, -2.5, 0, 0, 0], Health.HEALTHY,
    ),
    (
        "00 00 00 05 00 00 00 1D 00 00 00 00 00 00 00 01 FF FF FF FF 00 00 00 02 FF FF FF FE 00 00 00 03 FF FF FF FD",
        5, 29, 0, [1e-6, -1e-6, 2e-6, -2e-6, 3e-6, -3e-6], Health.HEALTHY,
    ),
    (
        "00 00 00 06 00 00 00 24 00 00 00 00 00 BC 61 4E FF 7A 40 08 00 07 A1 20 00 03 D0 90 FF FE 17 B8 00 00 F4 24",
        6, 36, 0, [12.345678, -8.765432, 0.5, 0.25, -0.125, 0.0625], Health.HEALTHY,
    ),
    (
        f"00 00 00 07 00 00 00 2B 80 01 00 00 {ZERO[:23]} FE FC 99 C0 {ZERO[:35]}",
        7, 43, 0x80010000, [0, 0, -17, 0, 0, 0], Health.WARNING,
    ),
    (f"00 00 00 08 00 00 00 32 80 02 00 00 {ZERO}", 8, 50, 0x80020000, [0] * 6, Health.ERROR),
    (f"00 00 00 09 00 00 00 39 80 00 00 04 {ZERO}", 9, 57, 0x80000004, [0] * 6, Health.ERROR),
    (f"00 00 00 0A 00 00 00 40 FF FF FF FF {ZERO}", 10, 64, 0xFFFFFFFF, [0] * 6, Health.ERROR),
    (
        f"7F FF FF FF 80 00 00 00 00 00 00 00 7F FF FF FF 80 00 00 00 {ZERO[:47]}",
        0x7FFFFFFF, 0x80000000, 0, [2147.483647, -2147.483648, 0, 0, 0, 0], Health.HEALTHY,
    ),
    (
        f"FF FF FF FF FF FF FF F0 00 00 00 00 {ZERO[:59]} 00 0F 42 40",
        0xFFFFFFFF, 0xFFFFFFF0, 0, [0, 0, 0, 0, 0, 1], Health.HEALTHY,
    ),
    (
        f"00 00 00 00 FF FF FF F7 00 00 00 00 {ZERO[:59]} 00 0F 42 40",
        0, 0xFFFFFFF7, 0, [0, 0, 0, 0, 0, 1], Health.HEALTHY,
    ),
]  # fmt: skip
STEPS = [
    (1, 2, Step.IN_ORDER, 0),
    (2, 2, Step.DUPLICATE, 0),
    (2, 5, Step.GAP, 2),
    (5, 4, Step.OUT_OF_ORDER, 0),
    (0xFFFFFFFF, 0, Step.IN_ORDER, 0),
    (0xFFFFFFFF, 3, Step.GAP, 3),
    (0, 0xFFFFFFFF, Step.OUT_OF_ORDER, 0),
    (0, 0x7FFFFFFF, Step.GAP, 2147483646),
    (0, 0x80000000, Step.OUT_OF_ORDER, 0),
]
SCALE = CountScale(per_newton=1e6, per_newton_metre=1e6)


@pytest.mark.parametrize(("sent", "request_"), REQUESTS, ids=[f"AT-1.{i + 1}" for i in range(len(REQUESTS))])
def test_requests(sent, request_):
    assert encode_request(request_) == bytes.fromhex(sent)
    assert decode_request(bytes.fromhex(sent)) == request_


@pytest.mark.parametrize(
    ("sent", "rdt", "ft", "status", "values", "how"), RECORDS, ids=[f"AT-2.{i + 1}" for i in range(len(RECORDS))]
)
def test_records(sent, rdt, ft, status, values, how):
    record = decode_record(bytes.fromhex(sent))
    assert record[:3] == (rdt, ft, status)
    assert SCALE.wrench(record.counts).tolist() == values
    assert SCALE.counts(values).tolist() == list(record.counts)
    assert health(status) is how
    assert encode_record(record) == bytes.fromhex(sent)


@pytest.mark.parametrize(
    ("previous", "current", "how", "lost"), STEPS, ids=[f"AT-sequence.{i + 1}" for i in range(len(STEPS))]
)
def test_sequence_steps(previous, current, how, lost):
    assert step(previous, current) == (how, lost)


def test_other_lengths_are_rejected():
    for n in (0, 8, 35, 37, 72):
        with pytest.raises(DatagramError, match="36 bytes"):
            decode_record(bytes(n))
    for n in (0, 7, 9):
        with pytest.raises(DatagramError, match="8 bytes"):
            decode_request(bytes(n))
    with pytest.raises(DatagramError, match="begins with 1234"):
        decode_request(bytes.fromhex("1235000200000000"))
    with pytest.raises(DatagramError, match="no command 0001"):
        decode_request(bytes.fromhex("1234000100000000"))
    assert [record.rdt_sequence for record in decode_buffer(bytes(36 * 3))] == [0, 0, 0]
    for n in (0, 35, 36 * (MOST_BUFFERED + 1)):
        with pytest.raises(DatagramError, match="1 to 40"):
            decode_buffer(bytes(n))
    with pytest.raises(ValueError, match="2\\^32"):
        encode_request(Request(Command.STOP, 1 << 32))
    with pytest.raises(ValueError, match="32-bit"):
        encode_record(Record(0, 0, 0, (1 << 31, 0, 0, 0, 0, 0)))


def test_marks_of_a_status():
    assert quality(0) == Quality.GOOD
    assert quality(0x80010000) == Quality.GOOD
    assert quality(0x80020000) == quality(0x80030000) == Quality.SATURATED
    assert quality(0x80000004) == quality(0x80000000) == quality(1) == Quality.SUSPECT
    assert quality(0xFFFFFFFF) == Quality.SATURATED | Quality.SUSPECT
    assert Status(0x80020000) == Status.ERROR_SUMMARY | Status.SATURATION_OR_CONVERTER


def configuration(**changed):
    tags = {"prodname": "Net F/T", "cfgcpf": "1000000", "cfgcpt": "1000", "scfgfu": "N", "scfgtu": "Nmm"} | changed
    return ("<netft>" + "".join(f"<{tag}>{text}</{tag}>" for tag, text in tags.items()) + "</netft>").encode()


def test_counts_per_unit_of_the_box_become_si():
    scale = read_configuration(configuration())
    assert (scale.per_newton, scale.per_newton_metre, scale.product) == (1e6, 1e6, "Net F/T")
    assert read_configuration(configuration(scfgtu="N-m")).per_newton_metre == 1e3
    assert read_configuration(configuration(scfgfu="kN")).per_newton == 1e3
    kilogram = read_configuration(configuration(scfgtu="kg-cm"))
    assert kilogram.wrench([0, 0, 0, 0, 0, 1000])[5] == pytest.approx(9.80665e-2)


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (configuration(scfgfu="stone"), "stone"),
        (configuration(cfgcpf="many"), "many"),
        (configuration(cfgcpf="0"), "positive"),
        (configuration(cfgcpt="inf"), "positive"),
        (configuration().replace(b"<cfgcpf>1000000</cfgcpf>", b""), "no cfgcpf"),
        (configuration().replace(b"</netft>", b"<cfgcpf>1</cfgcpf></netft>"), "twice"),
        (b"<!DOCTYPE x><netft/>", "document type"),
    ],
)
def test_configurations_that_are_refused(data, message):
    with pytest.raises(AtiFileError, match=message):
        read_configuration(data)


def record_of(sequence, status=0):
    return encode_record(Record(sequence % 2**32, 0, status, (0,) * 6))


def sequences(samples):
    return [sample.record.rdt_sequence for sample in samples]


def identity(reader, passed):
    counts = reader.counts
    return counts.received == passed + counts.duplicates + counts.late


def test_duplicates_and_late_ones_are_kept_out_and_gaps_marked():
    reader = RecordReader()
    samples = [s for n in (1, 2, 2, 5, 4, 6) for s in reader.feed(record_of(n))]
    assert [(s.record.rdt_sequence, s.lost_before) for s in samples] == [(1, 0), (2, 0), (5, 2), (6, 0)]
    assert (reader.counts.duplicates, reader.counts.late, reader.counts.lost) == (1, 1, 2)
    assert identity(reader, len(samples))


def test_a_restarted_box_is_followed_and_a_late_datagram_is_not():
    reader = RecordReader()
    samples = [s for n in [*range(1000, 1010), *range(1, 8)] for s in reader.feed(record_of(n))]
    assert sequences(samples)[10:] == list(range(RESTART_RUN, 8))
    assert (reader.counts.restarts, reader.counts.late, reader.counts.lost) == (1, RESTART_RUN - 1, 0)
    assert identity(reader, len(samples))
    # Doubled datagrams do not keep it from being seen.
    doubled = [s for n in range(1, 8) for _ in range(2) for s in reader.feed(record_of(n - 1000))]
    assert sequences(doubled)[-1] == (7 - 1000) % 2**32
    reader.restart()
    assert sequences(reader.feed(record_of(3))) == [3]


def test_status_is_counted():
    reader = RecordReader()
    samples = [reader.feed(record_of(n, s))[0] for n, s in enumerate((0, 0x80010000, 0x80020000, 0x80000004))]
    assert [s.quality for s in samples] == [Quality.GOOD, Quality.GOOD, Quality.SATURATED, Quality.SUSPECT]
    assert (reader.counts.warnings, reader.counts.errors, reader.counts.saturated) == (1, 2, 1)


@given(st.lists(st.binary(max_size=80), max_size=10), st.booleans())
@settings(max_examples=60)
def test_any_datagrams_are_survived(datagrams, buffered):
    reader, emulator = RecordReader(buffered=buffered), RdtEmulator(lambda t: (0,) * 6)
    for datagram in datagrams:
        reader.feed(datagram)
        emulator.feed(datagram, 0.0)
    assert reader.counts.rejected + reader.counts.received >= len(datagrams)
    reader.restart()
    assert sequences(reader.feed(record_of(9))) == [9]


@given(st.integers(0, 2**32 - 1), st.lists(st.sampled_from(["keep", "drop", "double"]), max_size=60))
@settings(max_examples=60)
def test_gaps_and_duplicates_are_counted_exactly_across_the_wrap(first, fates):
    reader, passed = RecordReader(), 0
    fates = ["keep", *fates, "keep"]
    for n, fate in enumerate(fates):
        for _ in range({"keep": 1, "drop": 0, "double": 2}[fate]):
            passed += len(reader.feed(record_of(first + n)))
    assert reader.counts.lost == fates.count("drop")
    assert reader.counts.duplicates == fates.count("double")
    assert reader.counts.late == 0
    assert identity(reader, passed)


# The emulator ---------------------------------------------------------------------------------------------------------


def pressed(time_s):
    """Return a wrench that every axis takes part in, within the range of a Nano17."""
    wave = np.sin(2 * np.pi * 3.0 * time_s)
    return (1.0 * wave, -2.0 * wave, -5.0 + wave, 0.01 * wave, -0.02 * wave, 0.003)


def box(wrench=pressed, **more):
    return RdtEmulator(wrench, **more)


def start(emulator, now_s=0.0, records=0, command=Command.START_REALTIME):
    return emulator.feed(encode_request(Request(command, records)), now_s)


def test_what_is_sensed_comes_back_to_a_count():
    emulator, reader = box(), RecordReader()
    assert start(emulator) == []
    samples = [s for datagram in emulator.poll(0.1) for s in reader.feed(datagram)]
    assert sequences(samples) == list(range(1, 101))
    scale = read_configuration(emulator.configuration())
    for sample in samples:
        # The sensor's own count tells the time: 7 kHz, 1 at time 0.
        at_s = (sample.record.ft_sequence - 1) / 7000
        assert np.abs(scale.wrench(sample.record.counts) - pressed(at_s)).max() <= 0.5e-6 * (1 + 1e-9)


def test_sequences_count_as_in_the_vectors():
    """AT-2: the sensor samples seven times for a record at 1 kHz."""
    emulator = box()
    start(emulator)
    records = [decode_record(datagram) for datagram in emulator.poll(0.01)]
    assert {b.ft_sequence - a.ft_sequence for a, b in pairwise(records)} == {7}


def test_counters_wrap():
    emulator, reader = box(first_sequence=2**32 - 3), RecordReader()
    start(emulator)
    samples = [s for datagram in emulator.poll(0.0065) for s in reader.feed(datagram)]
    assert sequences(samples)[:5] == [2**32 - 3, 2**32 - 2, 2**32 - 1, 0, 1]
    assert reader.counts.lost == 0


@pytest.mark.parametrize(("asked", "sent"), [(1000, 1000), (7000, 7000), (3000, 3500), (999, 1000), (1, 1)])
def test_rates_divide_that_of_the_sensor(asked, sent):
    assert box(rate_hz=asked).rate_hz == sent


def test_counts_end_by_themselves_and_stop_ends_the_rest():
    emulator = box()
    start(emulator, records=10)
    assert len(emulator.poll(1.0)) == 10
    assert emulator.next_event_s() == np.inf
    start(emulator, 1.0)
    assert len(emulator.poll(1.05)) == 50
    emulator.feed(encode_request(Request(Command.STOP)), 1.05)
    assert emulator.poll(2.0) == []
    assert emulator.feed(b"hello", 2.0) == []
    assert emulator.rejected == 1


def test_next_event_paces():
    emulator, times = box(), []
    start(emulator)
    while len(times) < 30:
        due_s = emulator.next_event_s()
        assert emulator.poll(due_s - 1e-6) == []
        assert len(emulator.poll(due_s)) == 1
        times.append(due_s)
    assert np.diff(times) == pytest.approx(1e-3)


def test_buffered_transfer():
    emulator, reader = box(buffer_records=8), RecordReader(buffered=True)
    start(emulator, records=20, command=Command.START_BUFFERED)
    datagrams = emulator.poll(1.0)
    assert [len(datagram) // 36 for datagram in datagrams] == [8, 8, 4]
    assert sequences([s for d in datagrams for s in reader.feed(d)]) == list(range(1, 21))


def test_bias_and_latch():
    emulator = box(lambda t: (0, 0, -3.0 if t < 0.5 else -4.0, 0, 0, 0), threshold_n=3.5)
    emulator.feed(encode_request(Request(Command.SET_SOFTWARE_BIAS)), 0.1)
    start(emulator, 0.1)
    before = decode_record(emulator.poll(0.2)[-1])
    assert (before.status, before.counts[2]) == (0, 0)
    after = decode_record(emulator.poll(0.6)[-1])
    assert (after.status, after.counts[2]) == (0x80010000, -1_000_000)
    low = box(lambda t: (0, 0, -4.0 if t < 0.5 else 0.0, 0, 0, 0), threshold_n=3.5)
    start(low)
    assert decode_record(low.poll(0.7)[-1]).status == 0x80010000  # It stays, after the load is gone,
    low.feed(encode_request(Request(Command.RESET_CONDITION_LATCH)), 0.7)
    assert decode_record(low.poll(0.8)[-1]).status == 0  # until it is reset.


def test_a_sensor_at_its_end_says_so():
    emulator, reader = box(lambda t: (0, 0, -40.0, 0, 0, 0)), RecordReader()
    start(emulator)
    (sample,) = reader.feed(emulator.poll(0.0005)[0])
    assert sample.quality == Quality.SATURATED
    assert sample.record.counts[2] == -35_000_000
    at_times = box(faults=[DatagramFault("saturated", 0.1, 0.2)])
    start(at_times)
    statuses = [decode_record(datagram).status for datagram in at_times.poll(0.3)]
    assert statuses.count(0x80020000) == 100
    assert set(statuses[:99] + statuses[200:]) == {0}


def received(*faults, seconds=2.0):
    emulator, reader = box(faults=faults), RecordReader()
    start(emulator)
    datagrams = emulator.poll(seconds) + emulator.feed(encode_request(Request(Command.STOP)), seconds)
    return reader, [s for datagram in datagrams for s in reader.feed(datagram)], datagrams


def test_dropped_datagrams_are_counted():
    reader, samples, _ = received(DatagramFault("dropped", every=7))
    assert sequences(samples) == [n for n in range(1, 2001) if n % 7]
    assert {sample.lost_before for sample in samples} == {0, 1}
    assert (reader.counts.lost, reader.counts.duplicates, reader.counts.late) == (2000 // 7, 0, 0)


def test_doubled_datagrams_are_kept_out():
    reader, samples, datagrams = received(DatagramFault("doubled", 1.0, 1.5))
    assert sequences(samples) == list(range(1, 2001))
    assert reader.counts.duplicates == len(datagrams) - 2000 == 500


def test_datagrams_out_of_order_are_kept_apart():
    reader, samples, datagrams = received(DatagramFault("out-of-order", every=10))
    assert len(datagrams) == 2000
    # The last one had no successor: it came when the box was stopped.
    assert sequences(samples) == [n for n in range(1, 2001) if n % 10 or n == 2000]
    assert (reader.counts.lost, reader.counts.late, reader.counts.restarts) == (199, 199, 0)
    assert identity(reader, len(samples))


def test_one_fault_does_not_shift_another():
    _, alone, _ = received(DatagramFault("dropped", every=7))
    _, both, _ = received(DatagramFault("dropped", every=7), DatagramFault("doubled", every=5))
    assert sequences(both) == sequences(alone)


def test_all_at_once_are_accounted_for():
    reader, samples, datagrams = received(
        DatagramFault("dropped", every=7), DatagramFault("doubled", every=5), DatagramFault("out-of-order", every=3)
    )
    assert reader.counts.received == len(datagrams)
    assert identity(reader, len(samples))
    assert sequences(samples) == sorted(set(sequences(samples)))


@pytest.mark.parametrize(
    "wrong", [{"rate_hz": 0.0}, {"rate_hz": 7001.0}, {"buffer_records": 41}, {"buffer_records": 0}]
)
def test_settings_that_a_box_does_not_have(wrong):
    with pytest.raises(UsageError):
        box(**wrong)


def test_faults_that_are_none():
    with pytest.raises(UsageError, match="no fault called .coffee.*doubled, dropped"):
        DatagramFault("coffee")


class ServedBox:
    """The emulator on loopback UDP, and its configuration by HTTP, in threads; real time."""

    host = "127.0.0.1"

    def __init__(self, emulator):
        self.emulator = emulator
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind((self.host, 0))
        self.port = self.socket.getsockname()[1]
        page = emulator.configuration()

        class Page(http.server.BaseHTTPRequestHandler):
            def do_GET(self):
                self.send_response(200 if self.path == CONFIGURATION_PATH else 404)
                self.send_header("Content-Type", "application/xml")
                self.send_header("Content-Length", str(len(page)))
                self.end_headers()
                self.wfile.write(page)

            def log_message(self, *_):
                pass

        self.pages = http.server.HTTPServer((self.host, 0), Page)
        self.http_port = self.pages.server_port
        self.ended = threading.Event()
        self.threads = [threading.Thread(target=self._serve), threading.Thread(target=self.pages.serve_forever)]

    def _serve(self):
        begun = time.monotonic()
        host = None
        while not self.ended.is_set():
            now_s = time.monotonic() - begun
            # 20 ms bounds how long an end is waited for; a timeout of zero would not block at all.
            self.socket.settimeout(min(max(self.emulator.next_event_s() - now_s, 1e-4), 0.02))
            try:
                datagram, host = self.socket.recvfrom(2048)
                sent = self.emulator.feed(datagram, time.monotonic() - begun)
            except TimeoutError:
                sent = self.emulator.poll(time.monotonic() - begun)
            for answer in sent:
                self.socket.sendto(answer, host)

    def __enter__(self):
        for thread in self.threads:
            thread.start()
        return self

    def __exit__(self, *_):
        self.ended.set()
        self.pages.shutdown()
        for thread in self.threads:
            thread.join(10.0)
        self.pages.server_close()
        self.socket.close()


STEADY = (1.0, -2.0, -3.5, 0.01, -0.02, 0.03)


def test_our_codec_reads_the_box_over_a_socket():
    with ServedBox(box(lambda t: STEADY)) as served, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as host:
        host.settimeout(10.0)
        host.connect((served.host, served.port))
        reader, samples = RecordReader(), []
        host.send(encode_request(Request(Command.START_REALTIME, 100)))
        while len(samples) < 100:
            samples += reader.feed(host.recv(2048))
    assert sequences(samples) == list(range(1, 101))
    assert SCALE.wrench(samples[-1].record.counts).tolist() == list(STEADY)


def test_pynetft_reads_the_box():
    """A client of others, which confirms the reading of its own source and not of the device."""
    pynetft = pytest.importorskip("pynetft", reason="pynetft, a client of others, is not installed")
    with ServedBox(box(lambda t: STEADY)) as served:
        config = pynetft.Config(sensor_host=served.host, rdt_port=served.port, http_port=served.http_port)
        with pynetft.Client(config, queue_size=64) as client:
            stream = client.samples(timeout=10.0)
            samples = [next(stream) for _ in range(50)]
            found = client.health()
    for sample in samples:
        assert (*sample.force, *sample.torque) == pytest.approx(STEADY, abs=0.5e-6)
        assert sample.status == 0
    assert (found.device_error_count, found.malformed_count) == (0, 0)
    assert found.sensor_configuration.calibration.counts_per_force_unit == 1e6
