"""The entry point: turns faults into three lines and an exit code.

It loads little, and the verbs only in :func:`main`: Ctrl-C while they load is met as well.
"""

from __future__ import annotations

import atexit
import gc
import os
import sys

from covertool.cli.interrupt import careful_interrupts, is_interrupt
from covertool.cli.memory import heed_limit, is_limited, out_of_memory
from covertool.errors import CovertoolError, FileError

# GDAL and PROJ may fetch what a file names, such as the address of a CRS. This program makes no
# request, whatever it is given: no name ends so, and nobody listens at that proxy.
os.environ |= {
    "CPL_VSIL_CURL_ALLOWED_EXTENSIONS": ".none",
    "GDAL_HTTP_PROXY": "http://127.0.0.1:9",
    "GDAL_HTTPS_PROXY": "http://127.0.0.1:9",
    "NO_PROXY": "",
    "no_proxy": "",
    "PROJ_NETWORK": "OFF",
}

# OpenBLAS, twice there, would keep buffers for a thread on each core. No verb has linear
# algebra that would gain by them.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

# Loading libraries makes objects that stay: to look through them for rubbish again and again takes
# a tenth of a short run. A run that goes on is still swept, once in this many new objects.
gc.set_threshold(50_000)

# The last sweep of all, when the interpreter ends, would look through what is about to go anyway.
atexit.register(gc.freeze)


def main(arguments: list[str] | None = None) -> int:
    """Run the command line and return its exit code.

    0 done; 1 a fault that the user can mend, told in three lines; 2 a usage error; 130 Ctrl-C.
    """
    given = sys.argv[1:] if arguments is None else arguments
    try:
        with careful_interrupts():
            heed_limit()
            from covertool.cli.verbs import command

            app = command(given)
            app(args=given, standalone_mode=True, prog_name="covertool", obj=tuple(given))
    except KeyboardInterrupt:
        return 130
    except BrokenPipeError:
        _drop_output()
        return 141
    except SystemExit as exit_:
        return exit_.code if isinstance(exit_.code, int) else 1
    except Exception as error:
        if is_interrupt(error):
            return 130
        if "--debug" in given or not _is_users(error):
            raise
        sys.stderr.write(f"{_told(error)}\n")
        return 1
    return 0


_OUT_OF_MEMORY = ("std::bad_alloc", "Insufficient memory")
"""How native libraries say that there is no memory left."""


def _is_users(error: Exception) -> bool:
    """Whether an error is one that a user can mend; any other is a fault of covertool."""
    if isinstance(error, SystemError):
        return is_limited()  # the interpreter's own word when an object could not be made
    known = isinstance(error, CovertoolError | MemoryError | OSError | ImportError)
    return known or any(words in str(error) for words in _OUT_OF_MEMORY)


def _told(error: Exception) -> CovertoolError:
    """Return a fault in three lines; of the system's own, those that a user can mend."""
    if isinstance(error, CovertoolError):
        return error
    if isinstance(error, MemoryError) or not isinstance(error, OSError | ImportError):
        return out_of_memory()
    if isinstance(error, ImportError) or error.errno is None:
        mend = "look with covertool doctor; there may be too little memory"
        return FileError(f"a library does not load: {error}", "this installation", mend)
    if error.filename is None:
        _drop_output()
    return FileError(
        f"the system refused: {error.strerror or error}",
        str(error.filename or "standard output"),
        "make room on the disk and check the rights, or see --debug",
    )


def _drop_output() -> None:
    """Let nothing more go to a standard output that takes nothing."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
