// Mean of the scene over the area of a photosite, or of a sample of one. Beyond the scene's grid its edge pixels continue.
// TAPS > 0, a scene finer than the photosites, or whose nearest pixel counts: a scene pixel is an even square, and the mean is exact.
// Where a lens distorts or the camera is posed, the area is a parallelogram (leaning_area.h), or where LEANS is 0 taken for an upright
// rectangle (upright_area.h). It touches at most TAPS pixels on either axis.
// TAPS 0, a scene of one pixel per photosite or fewer: the mean of SAMPLES x SAMPLES parts of the area, each at most one pixel wide.
// BENDS 1, of fewer: the exact mean of bilinear light (bilinear_area.h). BENDS 0, of one: the bilinear value at the middle of a part,
// which is the mean of even squares over one scene pixel's area.
#ifndef PHOTOSITE_AREA_H
#define PHOTOSITE_AREA_H
#include "bilinear_area.h"
#include "plain_math.h"
#include "seen_area.h"

// Part of pixel `number` [counted from `first`] that lies between `low` and `high` [px from the start of `first`].
INLINE float overlap(const float low, const float high, const uint number) {
    const float part = smaller(high, (float)(number + 1)) - larger(low, (float)number);
    return part > 0.0f ? part : 0.0f;
}

#endif
