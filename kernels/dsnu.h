// Dark signal nonuniformity: electrons [e-] -> electrons + sigma * normal [e-], a fixed offset of the photosite.
#ifndef DSNU_H
#define DSNU_H
#include "conventions.h"

INLINE float dsnu(const float electrons, const float normal, constant float *parameters) { return electrons + DSNU_SIGMA_E * normal; }

#endif
