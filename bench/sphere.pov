// SPDX-License-Identifier: GPL-3.0-or-later
// The reference sphere (tests/data/README.md), unlit, for POV-Ray 3.7. bench/peers.py declares Index and Levels.
// POV-Ray is left-handed, y up: our (x, y, z) is (x, z, y) here.
#version 3.7;
#ifndef (Index) #declare Index = -1.5; #end
#ifndef (Levels) #declare Levels = 20; #end
// The defaults, 5 and 1/255, would darken. An adc_bailout of 0 gives the same picture as 0.001 (its mean differs by less
// than 2e-5), but follows rays of no weight down to the last level.
global_settings { assumed_gamma 1.0 max_trace_level Levels adc_bailout 0.001 }
#declare Shine = finish { ambient 0 diffuse 0 emission 1 }
camera { perspective location <0, 1.6, -6> up y right x angle 40 look_at <0, 1, 0> }
sky_sphere {
  pigment {
    function { max(0, asin(min(1, y))) / (pi / 2) }
    color_map { [0 rgb <1, 0.9, 0.75>] [1 rgb <0.25, 0.45, 0.9>] }
  }
}
polygon {
  5, <-40, 0, -40>, <40, 0, -40>, <40, 0, 40>, <-40, 0, 40>, <-40, 0, -40>
  // cells of a checker are cubes: the ground lies in the middle of a layer of them, where no rounding tells
  texture { pigment { checker rgb 0.8 rgb 0.2 translate -0.5 * y } finish { Shine } }
}
sphere {
  <0, 1, 0>, 1
  texture { pigment { rgbt 1 } finish { ambient 0 diffuse 0 reflection { 0, 1 fresnel on } conserve_energy } }
  interior { ior Index }
}
sphere { <0.5, 0.6, 2.5>, 0.6 texture { pigment { rgb <0.8, 0.05, 0.05> } finish { Shine } } }
sphere { <-0.9, 0.35, -2.2>, 0.35 texture { pigment { rgb <0.05, 0.1, 0.8> } finish { Shine } } }
