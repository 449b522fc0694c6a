/* Leg kinematics and gait of the robot $robot, in C99 and C++11.
 *
 * Made by  $command
 *          (phasmid $version); changes to this file are lost when it is made again.
 * Walk     $walk.
 *
 * Units    metres, radians, seconds.
 * Body     x forward, y left, z up; origin in the middle of the coxa axes.
 * Hip      Frame of a leg: origin on the coxa axis, z along that axis, x along the leg's neutral
 *          direction. p_body = R_body_hip p_hip + p_body_hip.
 * Legs     count from 0 in the order of phasmid_legs; phasmid counts the same legs from 1.
 * Joints   0 coxa, 1 femur, 2 tibia. For a leg without lateral offset
 *              r    = Lc + Lf cos q1 + Lt cos(q1 + q2)
 *              foot = (r cos q0, r sin q0, Lf sin q1 + Lt sin(q1 + q2))     in the hip frame.
$foot *          q0 > 0 turns the leg to the left, about +z; q1 > 0 lifts the femur; q2 < 0 bends the
 *          knee down. With all at zero the straight lines from axis to axis lie along x.
 *          Inverse kinematics returns the knee-up solution.
 * Servos   phasmid_servo_angles counts from the servos' zeros, by femur_bend and tibia_bend of the
 *          robot file. That file has no directions, channels or trims: add them in your code.
 */
#ifndef PHASMID_FIRMWARE_H
#define PHASMID_FIRMWARE_H

#include <math.h>

/* Number type of all functions and tables: most microcontrollers compute doubles in software.
 * Define it as double before this header is included to have more digits. */
#ifndef PHASMID_REAL
#define PHASMID_REAL float
#endif

#define PHASMID_LEGS $legs
#define PHASMID_SAMPLES $samples /* of one cycle */
#define PHASMID_CYCLE_TIME ((PHASMID_REAL)$period) /* [s] */
#define PHASMID_DUTY_FACTOR ((PHASMID_REAL)$duty_factor) /* fraction of the cycle in stance */

/* Results of the inverse kinematics. */
#define PHASMID_OK 0
#define PHASMID_OUT_OF_REACH 1
#define PHASMID_JOINT_LIMIT 2

/* Round-off that is allowed at full stretch (share of the squared length) and at limits [rad]. */
#define PHASMID_STRETCH_TOLERANCE \
    ((PHASMID_REAL)(sizeof(PHASMID_REAL) > sizeof(float) ? $stretch_tolerance : 1e-6))
#define PHASMID_LIMIT_TOLERANCE \
    ((PHASMID_REAL)(sizeof(PHASMID_REAL) > sizeof(float) ? $limit_tolerance : 1e-5))

typedef struct {
    PHASMID_REAL lengths[3];         /* coxa, femur, tibia [m] */
    PHASMID_REAL lateral_offset;     /* foot beside the coxa's plane, positive to the left [m] */
    PHASMID_REAL R_body_hip[3][3];   /* rotation of the hip frame */
    PHASMID_REAL p_body_hip[3];      /* hip in the body frame [m] */
    PHASMID_REAL neutral_foot[3];    /* in the hip frame [m] */
    PHASMID_REAL joint_limits[3][2]; /* lowest, highest angle [rad] */
    PHASMID_REAL servo_zero[3];      /* joint angles at which the servos are at zero [rad] */
} phasmid_leg;

static const phasmid_leg phasmid_legs[PHASMID_LEGS] = {
$leg_table
};

/* Phase at which each leg lifts. A leg stands where the fractional part of phase - offset is
 * at least 1 - PHASMID_DUTY_FACTOR. */
static const PHASMID_REAL phasmid_offsets[PHASMID_LEGS] = $offsets;

/* Legs that stand (1) and swing (0) at each sample; sample k has the phase k / PHASMID_SAMPLES. */
static const unsigned char phasmid_stance[PHASMID_SAMPLES][PHASMID_LEGS] = {
$stance_table
};

/* Joint angles at each sample [rad]. Between samples, linear interpolation deviates from the
 * planned angles by at most $deviation rad. */
static const PHASMID_REAL phasmid_gait_q[PHASMID_SAMPLES][PHASMID_LEGS][3] = {
$gait_table
};

/* Functions of <math.h> for the chosen type. */
static inline PHASMID_REAL phasmid_sqrt(PHASMID_REAL x)
{
    return sizeof(x) > sizeof(float) ? (PHASMID_REAL)sqrt((double)x)
                                     : (PHASMID_REAL)sqrtf((float)x);
}

static inline PHASMID_REAL phasmid_sin(PHASMID_REAL x)
{
    return sizeof(x) > sizeof(float) ? (PHASMID_REAL)sin((double)x)
                                     : (PHASMID_REAL)sinf((float)x);
}

static inline PHASMID_REAL phasmid_cos(PHASMID_REAL x)
{
    return sizeof(x) > sizeof(float) ? (PHASMID_REAL)cos((double)x)
                                     : (PHASMID_REAL)cosf((float)x);
}

static inline PHASMID_REAL phasmid_atan2(PHASMID_REAL y, PHASMID_REAL x)
{
    return sizeof(x) > sizeof(float) ? (PHASMID_REAL)atan2((double)y, (double)x)
                                     : (PHASMID_REAL)atan2f((float)y, (float)x);
}

static inline PHASMID_REAL phasmid_floor(PHASMID_REAL x)
{
    return sizeof(x) > sizeof(float) ? (PHASMID_REAL)floor((double)x)
                                     : (PHASMID_REAL)floorf((float)x);
}

/* Transform a point of a leg from its hip frame to the body frame [m]. */
static inline void phasmid_body_from_hip(int leg, const PHASMID_REAL hip[3], PHASMID_REAL body[3])
{
    const phasmid_leg *l = &phasmid_legs[leg];
    for (int i = 0; i < 3; i++) {
        body[i] = l->p_body_hip[i] + l->R_body_hip[i][0] * hip[0] + l->R_body_hip[i][1] * hip[1]
                  + l->R_body_hip[i][2] * hip[2];
    }
}

/* Transform a point of a leg from the body frame to its hip frame [m]. */
static inline void phasmid_hip_from_body(int leg, const PHASMID_REAL body[3], PHASMID_REAL hip[3])
{
    const phasmid_leg *l = &phasmid_legs[leg];
    const PHASMID_REAL x = body[0] - l->p_body_hip[0];
    const PHASMID_REAL y = body[1] - l->p_body_hip[1];
    const PHASMID_REAL z = body[2] - l->p_body_hip[2];
    for (int i = 0; i < 3; i++) {
        hip[i] = l->R_body_hip[0][i] * x + l->R_body_hip[1][i] * y + l->R_body_hip[2][i] * z;
    }
}

/* Compute the foot in the hip frame [m] for joint angles [rad]. */
static inline void phasmid_leg_fk(int leg, const PHASMID_REAL q[3], PHASMID_REAL foot[3])
{
    const phasmid_leg *l = &phasmid_legs[leg];
    const PHASMID_REAL s1 = phasmid_sin(q[0]), c1 = phasmid_cos(q[0]);
    const PHASMID_REAL s2 = phasmid_sin(q[1]), c2 = phasmid_cos(q[1]);
    const PHASMID_REAL s3 = phasmid_sin(q[1] + q[2]), c3 = phasmid_cos(q[1] + q[2]);
    const PHASMID_REAL r = l->lengths[0] + l->lengths[1] * c2 + l->lengths[2] * c3;
    foot[0] = c1 * r - s1 * l->lateral_offset;
    foot[1] = s1 * r + c1 * l->lateral_offset;
    foot[2] = l->lengths[1] * s2 + l->lengths[2] * s3;
}

/* Compute the foot in the body frame [m] for joint angles [rad]. */
static inline void phasmid_leg_fk_body(int leg, const PHASMID_REAL q[3], PHASMID_REAL foot[3])
{
    PHASMID_REAL hip[3];
    phasmid_leg_fk(leg, q, hip);
    phasmid_body_from_hip(leg, hip, foot);
}

/* Compute the joint angles [rad] that place the foot at a point of the hip frame [m], knee up and
 * leg outwards.
 *
 * Returns PHASMID_OK, or
 *   PHASMID_OUT_OF_REACH  the leg is too short, or cannot fold that far. q is then the leg
 *                         stretched or folded towards the point; it may be NaN if the point is.
 *   PHASMID_JOINT_LIMIT   a joint would pass its limits. q places the foot, without the limits. */
static inline int phasmid_leg_ik(int leg, const PHASMID_REAL foot[3], PHASMID_REAL q[3])
{
    const phasmid_leg *l = &phasmid_legs[leg];
    const PHASMID_REAL femur = l->lengths[1], tibia = l->lengths[2], left = l->lateral_offset;
    const PHASMID_REAL x = foot[0], y = foot[1], z = foot[2];
    const PHASMID_REAL beside = x * x + y * y - left * left;
    const PHASMID_REAL r = beside > 0 ? phasmid_sqrt(beside) : 0;
    const PHASMID_REAL out = r - l->lengths[0];
    const PHASMID_REAL square = out * out + z * z;
    const PHASMID_REAL longest = (femur + tibia) * (femur + tibia);
    const PHASMID_REAL shortest = (femur - tibia) * (femur - tibia);
    /* Half the knee's bend is the angle of (t2, t1). The line from the femur axis to the foot,
     * turned up by the angle of (along, across), is the femur. */
    const PHASMID_REAL t1 = square < longest ? phasmid_sqrt(longest - square) : 0;
    const PHASMID_REAL t2 = square > shortest ? phasmid_sqrt(square - shortest) : 0;
    const PHASMID_REAL along = square + (femur + tibia) * (femur - tibia), across = t1 * t2;
    const PHASMID_REAL least = -PHASMID_STRETCH_TOLERANCE * longest;
    if (left < 0 || left > 0) {
        q[0] = phasmid_atan2(y * r - x * left, x * r + y * left);
    } else {
        q[0] = phasmid_atan2(y, x);
    }
    q[1] = phasmid_atan2(z * along + out * across, out * along - z * across);
    q[2] = -2 * phasmid_atan2(t1, t2);
    /* Written so that NaN is out of reach. */
    if (!(beside >= least && longest - square >= least && square - shortest >= least)) {
        return PHASMID_OUT_OF_REACH;
    }
    for (int i = 0; i < 3; i++) {
        if (q[i] < l->joint_limits[i][0] - PHASMID_LIMIT_TOLERANCE
            || q[i] > l->joint_limits[i][1] + PHASMID_LIMIT_TOLERANCE) {
            return PHASMID_JOINT_LIMIT;
        }
    }
    return PHASMID_OK;
}

/* Compute the joint angles as phasmid_leg_ik does, for a point of the body frame [m]. */
static inline int phasmid_leg_ik_body(int leg, const PHASMID_REAL foot[3], PHASMID_REAL q[3])
{
    PHASMID_REAL hip[3];
    phasmid_hip_from_body(leg, foot, hip);
    return phasmid_leg_ik(leg, hip, q);
}

/* Interpolate the joint angles [rad] of all legs at a phase; whole numbers are full cycles.
 * Keep the phase small: a large float has few digits after the point. */
static inline void phasmid_gait(PHASMID_REAL phase, PHASMID_REAL q[PHASMID_LEGS][3])
{
    PHASMID_REAL at = (phase - phasmid_floor(phase)) * PHASMID_SAMPLES;
    if (!(at < PHASMID_SAMPLES)) {
        at = 0; /* A phase just below a whole number may round to it; NaN. */
    }
    const int now = (int)at;
    const int next = (now + 1) % PHASMID_SAMPLES;
    const PHASMID_REAL share = at - (PHASMID_REAL)now;
    for (int leg = 0; leg < PHASMID_LEGS; leg++) {
        for (int i = 0; i < 3; i++) {
            const PHASMID_REAL from = phasmid_gait_q[now][leg][i];
            q[leg][i] = from + share * (phasmid_gait_q[next][leg][i] - from);
        }
    }
}

/* Convert joint angles to angles from the zeros of the servos [rad]. */
static inline void phasmid_servo_angles(int leg, const PHASMID_REAL q[3], PHASMID_REAL servo[3])
{
    for (int i = 0; i < 3; i++) {
        servo[i] = q[i] - phasmid_legs[leg].servo_zero[i];
    }
}

#endif
