"""Keys for daemons that require them: seals a command in an envelope whose tag proves who sent it."""

import hashlib
import hmac
import re
import time

from freeflex import messages

_TAG = 32  # [bytes]


class Key:
    """A key that `freeflex keygen` made: its id, which is the sender of sealed commands, and its secret of 32 bytes."""

    def __init__(self, id, secret):
        if not re.fullmatch(r"[A-Za-z0-9_.-]{1,31}", id):
            raise ValueError(f"id {id!r} of a key must be 1 to 31 of A-Z a-z 0-9 _ . -")
        if len(secret) != 32:
            raise ValueError(f"the secret has {len(secret)} bytes, but must have 32")
        self.id, self.secret = id, bytes(secret)

    @classmethod
    def read(cls, path):
        """Reads a file with lines `id: NAME` and `secret: 64 hexadecimal digits`; ignores other lines."""
        found = {}
        with open(path, encoding="utf-8") as file:
            for line in file:
                if match := re.match(r"(id|secret):\s*(\S+)\s*$", line):
                    found[match.group(1)] = match.group(2)
        if "id" not in found or not re.fullmatch(r"[0-9a-fA-F]{64}", found.get("secret", "")):
            raise ValueError(f"{path} contains no key; it needs the lines 'id: NAME' and 'secret: 64 hexadecimal digits', "
                             "as freeflex keygen writes them")
        return cls(found["id"], bytes.fromhex(found["secret"]))

    def seal(self, command, channel, valid_for=2.0):
        """Returns an envelope, as bytes, that contains a force_t or control_t for a channel (full name). The envelope
        is valid for `valid_for` [s] of wall clock. Sets the command's sender."""
        command.sender = self.id
        envelope = messages.envelope_t(key_id=self.id, session=command.session, sequence=command.sequence,
                                       valid_until=time.time_ns() // 1000 + round(valid_for * 1e6),
                                       body=command.encode())
        data = envelope.encode()[:-_TAG]
        name = channel.encode()
        return data + hmac.digest(self.secret, len(name).to_bytes(4, "big") + name + data, hashlib.sha512)[:_TAG]

    def __repr__(self):
        return f"Key({self.id!r})"
