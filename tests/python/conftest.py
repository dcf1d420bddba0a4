"""What every test may count on."""

import signal

# A shell starts what it runs in the background with Ctrl-C ignored, and children inherit that: tests of an
# interrupt would wait for what never comes.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)
