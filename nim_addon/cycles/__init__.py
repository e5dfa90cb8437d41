# SPDX-License-Identifier: GPL-3.0-or-later
"""Everything that touches Blender and Cycles: the material, render settings, the render, the proof."""
