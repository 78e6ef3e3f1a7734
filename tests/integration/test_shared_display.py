"""One display shared by threads and processes: turns, closing, forks, on real ptys and sockets."""

import multiprocessing
import os
import select
import signal
import socket
import subprocess
import sys
import threading

import pytest
from carriers import CARRIERS, eventually
from conftest import DEADLINE_S, ROOT
from pluggable_pty import noise_frame

import voxdisplay as vd
from voxdisplay.transport import open_transport

pytestmark = [
    pytest.mark.skipif(not hasattr(os, "fork"), reason="threads and forks of POSIX"),
    # Python 3.12 and later; the device on the pty is a thread.
    pytest.mark.filterwarnings("ignore:.*use of fork:DeprecationWarning"),
]


def run_threads(*targets):
    """Run functions at the same time; raise what any of them raised."""
    errors = []

    def run(target):
        try:
            target()
        except BaseException as error:  # noqa: BLE001 - it is raised again
            errors.append(error)

    threads = [threading.Thread(target=run, args=(target,), daemon=True) for target in targets]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(DEADLINE_S)
    assert not any(thread.is_alive() for thread in threads), "a thread hangs"
    for error in errors:
        raise error


# -- threads


@pytest.mark.parametrize("port", ["sim:?size=17x9x5&format=index8", "pty"])
def test_threads_that_present_read_ask_and_poll_take_turns(port, plug):
    port = str(plug.plug().path) if port == "pty" else port
    with vd.open(port) as display:

        def present():
            for seed in range(25):
                frame = noise_frame(display, seed)
                assert display.present(frame).digest == frame.digest()

        def read():
            for _ in range(25):
                assert display.read().shape == (5, 9, 17)

        def ask():
            for _ in range(25):
                assert display.digest() is not None
                display.poll()

        def hand_over():
            for seed in range(25):
                display.present(noise_frame(display, seed), wait=False)
                display.frame(keep=True)

        run_threads(present, present, read, ask, hand_over)
        frame = noise_frame(display, 99)
        display.present(frame)
        display.verify(frame)


def test_closing_without_flush_ends_the_call_of_another_thread(plug):
    display = vd.open(str(plug.plug().path))
    plug.hold()

    def present():
        with pytest.raises(vd.LocalProtocolError, match="closed by another thread"):
            display.present(noise_frame(display, 1))

    def close():
        eventually(lambda: plug.held, "a frame on its way")
        display.close(flush=False)

    run_threads(present, close)
    plug.release()
    vd.open(str(plug.path)).close()  # the port is free


def test_closing_waits_for_the_call_of_another_thread(plug):
    display = vd.open(str(plug.plug().path))
    plug.hold()
    receipts = []

    def present():
        receipts.append(display.present(noise_frame(display, 1)))

    def close():
        eventually(lambda: plug.held, "a frame on its way")
        plug.release()
        display.close()

    run_threads(present, close)
    assert receipts[0].frame == 1
    with pytest.raises(vd.LocalProtocolError, match="the display is closed"):
        display.poll()


def test_closing_ends_the_wait_of_another_thread_for_a_device(plug):
    display = vd.open(str(plug.plug().path), reconnect_s=3600)
    waiting = threading.Event()
    display._connection._reconnector._note = lambda _text: waiting.set()
    plug.unplug()

    def clear():
        with pytest.raises(vd.LocalProtocolError, match="closed by another thread"):
            display.clear()

    def close():
        assert waiting.wait(DEADLINE_S)
        display.close(flush_timeout_s=0.1)

    run_threads(clear, close)


# -- processes


def in_child(action):
    """Fork; return the pid of a child that runs ``action`` and waits to be killed."""
    ready, done = os.pipe()
    pid = os.fork()
    if pid == 0:
        try:
            text = action()
        except BaseException as error:  # noqa: BLE001 - reported to the parent
            text = f"{type(error).__name__}: {error}"
        os.write(done, (text or "done").encode())
        signal.pause()
        os._exit(0)
    os.close(done)
    readable, _, _ = select.select([ready], [], [], DEADLINE_S)
    text = os.read(ready, 4096).decode() if readable else "it hangs"
    os.close(ready)
    return pid, text


def end(pid):
    os.kill(pid, signal.SIGKILL)
    os.waitpid(pid, 0)


def test_the_port_is_free_as_soon_as_it_is_closed_whoever_inherited_it(plug):
    display = vd.open(str(plug.plug().path))
    pid, _ = in_child(lambda: None)
    try:
        display.close()
        with vd.open(str(plug.path)) as again:
            again.clear()
    finally:
        end(pid)


def test_the_port_is_free_after_a_process_pool_was_forked(plug):
    display = vd.open(str(plug.plug().path))
    with multiprocessing.get_context("fork").Pool(2) as pool:
        pool.map(abs, [-1, 2])
        display.close()
        vd.open(str(plug.path)).close()


def use_all(display):
    """Try everything; return what each said."""
    frame = vd.Frame(display.info.grid, display.info.format)
    calls = {
        "present": lambda: display.present(frame),
        "unwaited": lambda: display.present(frame, wait=False),
        "read": display.read,
        "digest": display.digest,
        "flush": display.flush,
        "poll": display.poll,
        "keep": lambda: display.frame(keep=True),
    }
    results = []
    for name, call in calls.items():
        try:
            call()
            results.append(f"{name} worked")
        except vd.LocalProtocolError as error:
            results.append("refused" if "forked" in str(error) else str(error))
    return ", ".join(sorted(set(results)))


def test_a_forked_process_is_refused_and_disturbs_nobody(plug):
    with vd.open(str(plug.plug().path)) as display:
        frame = noise_frame(display, 1)
        display.present(frame)
        held = threading.Event()
        release = threading.Event()

        def hold_lock():  # as it may be when another thread forks
            with display._lock:
                held.set()
                release.wait(DEADLINE_S)

        holder = threading.Thread(target=hold_lock)
        holder.start()
        assert held.wait(DEADLINE_S)
        pid, text = in_child(lambda: use_all(display))
        release.set()
        holder.join()
        try:
            assert text == "refused"
            display.verify(frame)
        finally:
            end(pid)


def test_a_forked_process_that_closes_leaves_the_display_to_the_other(plug):
    with vd.open(str(plug.plug().path)) as display:
        display.present(noise_frame(display, 1), wait=False)

        def close():
            display.close()
            display.close(blank=True)

        pid, text = in_child(close)
        try:
            assert text == "done"
            frame = noise_frame(display, 2)
            assert display.present(frame).digest == frame.digest()
        finally:
            end(pid)


@pytest.mark.parametrize("scheme", ["tcp", "socket"])
def test_a_closed_connection_ends_whoever_inherited_it(emulator, scheme):
    port = emulator("--tcp", "127.0.0.1:0", "--size", "3x5x7").port.replace("tcp:", f"{scheme}:")
    display = vd.open(port)
    pid, text = in_child(lambda: use_all(display))
    assert text == "refused"
    try:
        display.close()
        with vd.open(port) as again:  # the server serves one at a time
            again.clear()
    finally:
        end(pid)


@pytest.mark.parametrize("scheme", ["tcp", "socket"])
def test_a_forked_process_does_not_shut_the_connection_down(scheme):
    with socket.create_server(("127.0.0.1", 0)) as server:
        transport = open_transport(f"{scheme}://127.0.0.1:{server.getsockname()[1]}")
        peer, _ = server.accept()
        pid, text = in_child(transport.close)
        try:
            assert text == "done"
            transport.write(b"still here", 5)
            peer.settimeout(DEADLINE_S)
            assert peer.recv(99) == b"still here"
            transport.close()
            assert peer.recv(99) == b"", "the end, although a child had the connection, too"
        finally:
            end(pid)
            peer.close()


# pyserial's reader of rfc2217:// is a thread of the old style.
@pytest.mark.filterwarnings("ignore:set(Daemon|Name)")
@pytest.mark.parametrize("scheme", ["pty", "rfc2217"])
def test_a_forked_process_has_no_port_whose_end_could_disturb(scheme):
    """Objects of pyserial shut their connection down when they are collected, or Python ends."""
    with CARRIERS[scheme]() as (transport, peer):
        line = transport._serial
        descriptor = line.fileno() if scheme != "rfc2217" else line._socket.fileno()

        def collect():
            assert not line.is_open
            line.__del__()
            with pytest.raises(OSError, match="Bad file descriptor"):
                os.fstat(descriptor)

        pid, text = in_child(collect)
        try:
            assert text == "done"
            transport.write(b"still here", 5)
            assert peer.read(10) == b"still here"
        finally:
            end(pid)


def test_a_second_process_is_told_that_the_port_is_busy(plug):
    code = f"import voxdisplay as vd; vd.open({str(plug.plug().path)!r})"
    with vd.open(str(plug.path)):
        other = subprocess.run(
            [sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT, check=False
        )
        assert "is busy" in other.stderr


def test_a_close_in_a_forked_process_does_not_give_the_port_away(plug):
    with vd.open(str(plug.plug().path)) as display:
        pid, text = in_child(display.close)
        try:
            assert text == "done"
            with pytest.raises(vd.OpenError, match="is busy"):
                vd.open(str(plug.path))
        finally:
            end(pid)


def test_a_display_that_is_closed_twice_from_many_threads(plug):
    display = vd.open(str(plug.plug().path))
    display.present(noise_frame(display, 1), wait=False)
    run_threads(*[display.close] * 5)
    vd.open(str(plug.path)).close()
