"""Servos: motor, gears, position law and heat."""

from phasmid.servo.catalogue import load_servo, servo_names
from phasmid.servo.friction import Friction
from phasmid.servo.motor import Motor
from phasmid.servo.rules import complete_servo
from phasmid.servo.servo import Servo

__all__ = ["Friction", "Motor", "Servo", "complete_servo", "load_servo", "servo_names"]
