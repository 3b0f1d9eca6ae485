"""The fingerprint of a protocol: equal for equal values, whatever the file looks like."""

import hashlib
import json

from protocols.dumping import protocol_values
from protocols.recording_protocol import RecordingProtocol
from protocols.study_protocol import StudyProtocol


def protocol_hash(protocol: StudyProtocol | RecordingProtocol) -> str:
    """SHA-256, 64 hexadecimal digits, of all values, defaults included.

    Comments, the order of keys, and whether a default is written out make no difference. The title and the source
    count: they, too, are what was fixed before data came in.
    """
    # JSON writes 0.0 and -0.0 apart, though the values are equal.
    text = json.dumps(protocol_values(protocol), sort_keys=True, separators=(",", ":"), allow_nan=False)
    plain = json.loads(text, parse_float=lambda digits: float(digits) + 0.0)
    canonical = json.dumps(plain, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return hashlib.sha256(canonical.encode()).hexdigest()
