# SPDX-License-Identifier: GPL-3.0-or-later
"""The packages of the wheel, found rather than listed: all folders of nim_addon, data among them, and osl as one of them."""

from setuptools import find_namespace_packages, setup

setup(packages=[*find_namespace_packages(include=["nim_addon*"], exclude=["*__pycache__*"]), "nim_addon.osl"])
