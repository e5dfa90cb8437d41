# SPDX-License-Identifier: GPL-3.0-or-later
"""The version, in one place: of records, node groups, the command, the extension and the package."""

VERSION = "0.1.0"
