"""Prepared layouts in memory that processes share: large arrays pass no pipe, and no file is left behind."""

from __future__ import annotations

import mmap
import os
import pickle
import secrets
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from labgym.envs.stage import LayoutStage

ALIGNMENT = 64
"""Each array begins at a multiple of this, bytes."""
TOKEN = 16
"""Length of the token at the beginning of a parcel, bytes."""
SHARED = hasattr(os, "memfd_create") and Path("/proc/self/fd").is_dir()
"""Whether processes can share memory without a file that would be left behind; otherwise stages are sent as bytes."""


@dataclass(frozen=True)
class Address:
    """Where a process finds a parcel.

    Attributes:
        process, descriptor: an open file of a process.
        token: the first bytes of the parcel.
    """

    process: int
    descriptor: int
    token: bytes

    @property
    def path(self) -> str:
        """Path of the open file."""
        return f"/proc/{self.process}/fd/{self.descriptor}"


class Parcel:
    """An open anonymous file in memory with a stage; it is freed when all processes have closed it.

    Args:
        descriptor: the open file, which the parcel closes in the end.
        token: its first bytes.
    """

    def __init__(self, descriptor: int, token: bytes) -> None:
        self._descriptor, self._token = descriptor, token

    def __del__(self) -> None:
        self.close()

    @property
    def address(self) -> Address:
        """Where other processes find the parcel while it is open here."""
        return Address(os.getpid(), self._descriptor, self._token)

    def close(self) -> None:
        """Close the file here; it is safe to call this more than once."""
        descriptor, self._descriptor = self._descriptor, -1
        if descriptor >= 0:
            with suppress(OSError):
                os.close(descriptor)

    @classmethod
    def of(cls, stage: LayoutStage) -> Parcel:
        """Return a parcel with a stage.

        Raises:
            OSError: there is no memory for it.
        """
        buffers: list[pickle.PickleBuffer] = []
        body = pickle.dumps(stage, protocol=5, buffer_callback=buffers.append)
        arrays = [buffer.raw() for buffer in buffers]
        parts: list[bytes | memoryview] = [body, *arrays]
        head = pickle.dumps([len(body), *(array.nbytes for array in arrays)])
        token = secrets.token_bytes(TOKEN)
        parcel = cls(os.memfd_create("labgym", os.MFD_CLOEXEC), token)
        with os.fdopen(os.dup(parcel._descriptor), "wb") as file:
            file.write(token + len(head).to_bytes(8, "little") + head)
            for part in parts:
                file.seek(-file.tell() % ALIGNMENT, os.SEEK_CUR)
                file.write(part)
        return parcel

    @classmethod
    def at(cls, address: Address) -> Parcel:
        """Return a parcel that another process has open, open in this process too.

        Raises:
            OSError: it is open no longer, or belongs to another user.
        """
        return cls(os.open(address.path, os.O_RDONLY | os.O_CLOEXEC), address.token)

    def stage(self) -> LayoutStage:
        """Return the stage, copied from the shared memory.

        Raises:
            OSError: the file is not the parcel.
        """
        size = os.fstat(self._descriptor).st_size
        if size < TOKEN + 8:
            raise OSError("the file is not a prepared layout")
        # A separate mapping goes back to the system with the stage; memory of the heap would remain in fragments.
        memory = memoryview(mmap.mmap(-1, size, mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS))
        if os.preadv(self._descriptor, [memory], 0) != size or memory[:TOKEN] != self._token:
            raise OSError("the file is not the prepared layout that was announced")
        place = TOKEN + 8
        length = int.from_bytes(memory[TOKEN:place], "little")
        parts: list[memoryview] = []
        place += length
        for size in pickle.loads(memory[place - length : place]):  # noqa: S301 -- the token came from the pool
            place += -place % ALIGNMENT
            parts.append(memory[place : place + size])
            place += size
        body, *arrays = parts
        stage: LayoutStage = pickle.loads(body, buffers=arrays)  # noqa: S301 -- as above
        return stage
