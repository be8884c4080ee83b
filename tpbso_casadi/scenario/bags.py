"""Motions in the bags of ROS 2: MCAP, read by the libraries of the extra ``mcap``."""

from __future__ import annotations

import io
import struct
from collections import Counter
from collections.abc import Iterator
from importlib.util import find_spec
from typing import Any, NamedTuple

from problems.base import in_words
from tpbso_casadi.scenario.input_files import InputFolder
from tpbso_casadi.scenario.recorded_rows import AS_IT_IS, BadRow, Reading, RecordedRows
from tpbso_casadi.scenario.ros_messages import rows_of_controller, rows_of_message, rows_of_states

STATES = "sensor_msgs/msg/JointState"
CONTROLLER = "control_msgs/msg/JointTrajectoryControllerState"
TYPES = ("trajectory_msgs/msg/JointTrajectory", "moveit_msgs/msg/RobotTrajectory", "moveit_msgs/msg/DisplayTrajectory")
LIBRARIES = ("mcap", "mcap_ros2")
LARGEST_BAG = 1_000_000_000  # bytes, once its chunks are unpacked
MOST_TOPICS = 8  # that are listed


class _Recorded(NamedTuple):
    """A message of a bag, not decoded."""

    topic: str
    encoding: str
    schema: Any
    data: bytes
    time: float


def read_bag(folder: InputFolder, name: str, reading: Reading = AS_IT_IS, of_log: bool = False) -> RecordedRows:
    """The rows of a trajectory that was recorded, or where there is none, of the states of a controller or of joints.

    Args:
        folder: that holds the file.
        name: of the file.
        reading: which of the topics, and which of the trajectories, in the order in which they were written.
        of_log: whether rows as commanded and as measured are needed, which states of a controller are.

    Raises:
        BadRow: it is no bag, has no such message, or the libraries are missing.
        ScenarioError: the file cannot be read.
    """
    if any(find_spec(library) is None for library in LIBRARIES):
        raise BadRow("bags need the extra mcap: pip install 'tpbso-casadi[mcap]'")
    content = folder.read_bytes(name)
    kinds = (CONTROLLER,) if of_log else (*TYPES, CONTROLLER, STATES)
    known = [each for each in _messages(content) if each.schema is not None and each.schema.name in kinds]
    topics = list(dict.fromkeys(each.topic for each in known))
    if reading.topic is not None and reading.topic not in topics:
        listed = ", ".join(f"{topic!r:.100}" for topic in topics[:MOST_TOPICS]) or "none of joints"
        raise BadRow(f"topic: no motion of {reading.topic!r:.100} is in it; there are {listed}")
    asked = [each for each in known if reading.topic in (None, each.topic)]
    found = [each for each in asked if each.schema.name in TYPES]
    if not found and asked and reading.message is None:
        return _rows_of_topic(asked)
    if not found:
        raise BadRow(f"no message of {in_words(kinds)} is in it")
    message = reading.message
    if message is None and len(found) > 1:
        counts = Counter(each.topic for each in found).most_common(MOST_TOPICS)
        listed = ", ".join(f"{count} of {topic!r:.100}" for topic, count in counts)
        raise BadRow(
            f"{len(found)} trajectories ({listed}); one is judged at a time: say which message, 1 to {len(found)}"
        )
    if message is not None and not 1 <= message <= len(found):
        raise BadRow(f"message {message} of {len(found)} trajectories")
    return rows_of_message(_decoded(found[(message or 1) - 1]))


def _rows_of_topic(asked: list[_Recorded]) -> RecordedRows:
    """The rows of the states of a controller where there are any, else of joints; they are those of one topic."""
    states = [each for each in asked if each.schema.name == CONTROLLER] or asked
    topics = dict.fromkeys(each.topic for each in states)
    if len(topics) > 1:
        listed = ", ".join(f"{topic!r:.100}" for topic in [*topics][:MOST_TOPICS])
        raise BadRow(f"topic: states of joints of {len(topics)} topics ({listed}); say which is read")
    rows_of = rows_of_controller if states[0].schema.name == CONTROLLER else rows_of_states
    return rows_of([(_decoded(each), each.time) for each in states])


def _messages(content: bytes) -> Iterator[_Recorded]:
    """All messages of a bag, in the order in which they were written; of one that was cut short what there is."""
    from mcap.exceptions import EndOfFile, McapError  # noqa: PLC0415 (an extra)
    from mcap.records import Channel, Chunk, Message, Schema  # noqa: PLC0415
    from mcap.stream_reader import StreamReader, breakup_chunk  # noqa: PLC0415

    schemas: dict[int, Any] = {}
    channels: dict[int, Any] = {}
    size = 0
    try:
        for outer in StreamReader(io.BytesIO(content), emit_chunks=True, record_size_limit=None).records:
            size += _unpacked_size(outer) if isinstance(outer, Chunk) else 0
            if size > LARGEST_BAG:
                raise BadRow(f"more than {LARGEST_BAG / 1e6:g} MB are in it")
            for record in breakup_chunk(outer) if isinstance(outer, Chunk) else [outer]:
                if isinstance(record, Schema):
                    schemas[record.id] = record
                elif isinstance(record, Channel):
                    channels[record.id] = record
                elif isinstance(record, Message):
                    channel = channels[record.channel_id]
                    schema = schemas.get(channel.schema_id)
                    yield _Recorded(
                        channel.topic, channel.message_encoding, schema, record.data, 1e-9 * record.log_time
                    )
    except EndOfFile:
        return
    except (McapError, KeyError, ValueError, RuntimeError, MemoryError, OverflowError, struct.error) as error:
        if isinstance(error, BadRow):
            raise
        raise BadRow(f"is no MCAP bag: {type(error).__name__}, {error}") from error


def _unpacked_size(chunk: Any) -> int:
    """Bytes: as the bag says, and as the packed data do, which decide."""
    import zstandard  # noqa: PLC0415 (comes with the reader)

    stated = zstandard.frame_content_size(chunk.data) if chunk.compression == "zstd" else 0
    return int(max(chunk.uncompressed_size, stated))


def _decoded(message: _Recorded) -> Any:
    """The content of a message as plain data."""
    from mcap_ros2.decoder import DecoderFactory  # noqa: PLC0415

    try:
        decode = DecoderFactory().decoder_for(message.encoding, message.schema)
        if decode is None:
            raise BadRow(f"{message.topic}: {message.encoding} with {message.schema.encoding} is no encoding of ROS 2")
        return _plain(decode(message.data))
    except BadRow:
        raise
    except Exception as error:  # whatever a schema or a message that is none leads to
        raise BadRow(f"{message.topic}: cannot be decoded: {type(error).__name__}, {error}") from error


def _plain(value: Any) -> Any:
    """A message of ROS as tables, lists and numbers."""
    if hasattr(value, "__slots__"):
        return {name: _plain(getattr(value, name)) for name in value.__slots__}
    if isinstance(value, list | tuple):
        return [_plain(entry) for entry in value]
    return value.tolist() if hasattr(value, "tolist") else value
