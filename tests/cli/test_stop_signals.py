import os
import signal
import threading

import pytest

from tactile_core.cli.main import Stopped, stopping

pytestmark = pytest.mark.skipif(os.name == "nt", reason="Windows ends a process on SIGTERM without asking it")


@pytest.fixture(params=["SIGTERM", "SIGHUP"])
def number(request):
    """One of the signals, with the system's default handler, as in a process that a shell starts."""
    number = getattr(signal, request.param)
    before = signal.signal(number, signal.SIG_DFL)
    yield number
    signal.signal(number, before)


def test_a_signal_raises_once_and_the_handlers_come_back(number):
    cleaned = False
    with pytest.raises(Stopped) as stop, stopping():
        try:
            signal.raise_signal(number)
        finally:
            signal.raise_signal(number)  # during the clean-up: ignored
            cleaned = True
    assert cleaned
    assert stop.value.number == number and str(stop.value) == signal.Signals(number).name
    assert signal.getsignal(number) is signal.SIG_DFL


def test_other_handlers_stay(number):
    signal.signal(number, signal.SIG_IGN)
    with stopping():
        signal.raise_signal(number)
    assert signal.getsignal(number) is signal.SIG_IGN


def test_threads_change_no_handler(number):
    seen = []

    def work():
        with stopping():
            seen.append(signal.getsignal(number))

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert seen == [signal.SIG_DFL]
