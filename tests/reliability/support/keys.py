"""API keys for the proofs, as files of `access.keys_file`."""

import hashlib
from pathlib import Path


def write_keys(file: Path, keys: dict[str, str], scopes: tuple[str, ...] = ("detect",)) -> None:
    """Writes a file of keys by their names."""
    quoted = ", ".join(f'"{scope}"' for scope in scopes)
    lines = (
        f'{name} = {{ scopes = [{quoted}], sha256 = "{hashlib.sha256(key.encode()).hexdigest()}" }}\n'
        for name, key in keys.items()
    )
    file.write_text("".join(lines), encoding="utf-8")
