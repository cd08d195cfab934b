// Lists of slabs of radius (occlusion.cl). Each list begins with a group of its own, of SLAB_GROUP slabs, in which the numbers of one kind
// stand side by side, so that they are read as vectors; the last slab fills the rest of its group.
#ifndef SLAB_LIST_H
#define SLAB_LIST_H
#include "conventions.h"

// Element of a slab's first number in (groups, 6, SLAB_GROUP); its others follow SLAB_GROUP apart, in the order of occlusion.cl.
INLINE uint slab_element(const uint slab) { return 6 * (slab & ~(SLAB_GROUP - 1u)) + (slab & (SLAB_GROUP - 1u)); }

#endif
