"""Practice records that sensors or protocols spoil, made from records that are exact otherwise."""

from validation.practice.spoiled.draw import draw_spoiled_protocol, draw_spoiled_sensor
from validation.practice.spoiled.plans import PLANS
from validation.practice.spoiled.sensors import SENSORS

__all__ = ["PLANS", "SENSORS", "draw_spoiled_protocol", "draw_spoiled_sensor"]
