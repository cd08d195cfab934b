// Parts of the sensor's chain, the values of PART: the chain is split where crosstalk or binning lies between charge and readout.
#ifndef SENSOR_PART_H
#define SENSOR_PART_H

#define WHOLE 0   // the whole chain,
#define CHARGE 1  // from light to the electrons in the well,
#define READOUT 2 // from those electrons to the code

// Rows of a pair that a launch gives, since a frame may begin or end within a pair.
#define FIRST_ROW 1
#define SECOND_ROW 2
#define BOTH_ROWS 3

#if PART == CHARGE
typedef float result_type;
#else
typedef ushort result_type;
#endif

#endif
