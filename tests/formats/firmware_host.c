/* Reads the numbers of poses and phases, the poses (leg, foot in the hip frame, foot in the body
 * frame) and the phases; writes what the header computes. All numbers are doubles. */
#include <stdio.h>
#include <stdlib.h>
#include "walk.h"

static void get(FILE *file, PHASMID_REAL *values, int count)
{
    for (int i = 0; i < count; i++) {
        double value;
        if (fread(&value, sizeof value, 1, file) != 1) {
            exit(1);
        }
        values[i] = (PHASMID_REAL)value;
    }
}

static void put(FILE *file, const PHASMID_REAL *values, int count)
{
    for (int i = 0; i < count; i++) {
        const double value = (double)values[i];
        fwrite(&value, sizeof value, 1, file);
    }
}

int main(int argc, char **argv)
{
    FILE *in = argc == 3 ? fopen(argv[1], "rb") : NULL;
    FILE *out = argc == 3 ? fopen(argv[2], "wb") : NULL;
    PHASMID_REAL counts[2], pose[7], row[20], phase, q[PHASMID_LEGS][3];
    if (in == NULL || out == NULL) {
        return 1;
    }
    get(in, counts, 2);
    for (int i = 0; i < (int)counts[0]; i++) {
        get(in, pose, 7);
        const int leg = (int)pose[0];
        row[0] = (PHASMID_REAL)phasmid_leg_ik(leg, &pose[1], &row[1]);
        row[4] = (PHASMID_REAL)phasmid_leg_ik_body(leg, &pose[4], &row[5]);
        phasmid_leg_fk(leg, &row[1], &row[8]);
        phasmid_leg_fk_body(leg, &row[1], &row[11]);
        phasmid_servo_angles(leg, &row[1], &row[14]);
        put(out, row, 17);
    }
    for (int i = 0; i < (int)counts[1]; i++) {
        get(in, &phase, 1);
        phasmid_gait(phase, q);
        put(out, &q[0][0], 3 * PHASMID_LEGS);
    }
    for (int leg = 0; leg < PHASMID_LEGS; leg++) {
        put(out, &phasmid_offsets[leg], 1);
        put(out, phasmid_legs[leg].neutral_foot, 3);
    }
    for (int i = 0; i < PHASMID_SAMPLES; i++) {
        for (int leg = 0; leg < PHASMID_LEGS; leg++) {
            row[0] = phasmid_stance[i][leg];
            put(out, row, 1);
        }
    }
    row[0] = PHASMID_CYCLE_TIME;
    row[1] = PHASMID_DUTY_FACTOR;
    put(out, row, 2);
    return fclose(out);
}
