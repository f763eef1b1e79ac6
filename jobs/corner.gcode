; A bead with one right angle, from rest to rest.
G21 G90            ; millimetres, absolute
G0 X0 Y0 Z5        ; a rapid move lays nothing; the bead begins where it ends
G1 X400 F6000      ; 100 mm/s
G1 Y400
G0 Z50
M30
