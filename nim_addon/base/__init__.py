# SPDX-License-Identifier: GPL-3.0-or-later
"""What every part stands on: no Blender, no physics."""
