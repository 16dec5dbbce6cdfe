"""A failing test is repeated with a waveform."""

import os

import pytest


@pytest.hookimpl(wrapper=True)
def pytest_pyfunc_call(pyfuncitem):
    try:
        return (yield)
    except Exception as error:
        if os.environ.get("DYNRT_WAVES") == "1":
            raise
        # All that a test is made of begins anew with it: its testbenches' variables and generators of random numbers.
        arguments = {name: pyfuncitem.funcargs[name] for name in pyfuncitem._fixtureinfo.argnames}
        os.environ["DYNRT_WAVES"] = "1"
        try:
            pyfuncitem.obj(**arguments)
        except Exception as again:
            if type(again) is type(error):
                error.add_note("The waveform is in build/waves.")
        finally:
            del os.environ["DYNRT_WAVES"]
        raise
