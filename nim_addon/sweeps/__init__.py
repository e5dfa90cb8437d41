# SPDX-License-Identifier: GPL-3.0-or-later
"""Sweeps: many renders as one plan of independent requests, and who carries it out."""

PLAN, IMAGES = "plan.jsonl", "images"  # in the folder of a sweep
