# SPDX-License-Identifier: GPL-3.0-or-later
"""One render as a value: request.Request, what it is written as and known by, and the act of rendering it."""
