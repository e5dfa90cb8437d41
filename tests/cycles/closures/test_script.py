# SPDX-License-Identifier: GPL-3.0-or-later
"""The shaders: compiled into a file that says nothing of the machine, and without a trace in the scene."""

import sys

import bpy
import pytest

from nim_addon.cycles.closures import INTERFACE
from nim_addon.cycles.closures.script import bytecode_of, script_of, source


def test_the_engine_is_put_back(empty_file):
    bpy.context.scene.render.engine = "CYCLES"
    INTERFACE.group()
    assert bpy.context.scene.render.engine == "CYCLES"


def test_the_file_holds_nothing_of_the_machine_it_was_made_on(empty_file):
    # oslc writes its options, and in them the folders of whoever compiled, into a comment
    bytecode = script_of(INTERFACE.group()).bytecode
    assert sys.prefix not in bytecode and "/tmp" not in bytecode
    first, second = (bytecode_of(INTERFACE.shader, INTERFACE.source()) for _ in range(2))
    assert first == second


def test_a_shader_that_is_none_is_refused(empty_file, one_sentence, capfd):
    with pytest.raises(RuntimeError) as error:
        bytecode_of("nim_interface", "shader nim_interface( {}")
    one_sentence(error.value.args[0].replace("nim_interface.osl", "it"), "OSL compiler refused it")


def test_a_shader_that_is_missing_is_said(one_sentence):
    with pytest.raises(FileNotFoundError) as error:
        source("nim_mirror")
    one_sentence(error.value.args[0].replace("nim_mirror.osl", "it"), "osl/it is missing")
