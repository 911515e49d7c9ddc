"""A driver to start from: in each method put the call of your arm's, sensor's or camera's library.

``vendor`` stands for those libraries. Nothing here knows of grasps: the policy does the rest
(pipeline/robot). Try it slowly first: evaluate.policy.travel_m_s = 0.1 in run.toml.
"""

import math

import vendor  # your arm's and camera's own modules


class MyRobot:
    """One arm, a depth camera on its wrist, one beside the table, an ejector with a sensor."""

    period_s = 0.008  # the arm takes a setpoint every 8 ms

    def __init__(self):
        self.arm = vendor.Arm("192.168.0.10")
        self.on_wrist = vendor.DepthCamera("wrist")
        self.beside = vendor.DepthCamera("static")

    def base_from_flange(self):
        return self.arm.flange_pose()  # 4x4, metres; from x, y, z and a rotation where need be

    def reachable(self, base_from_flange):
        return self.arm.inverse_kinematics(base_from_flange) is not None

    def move(self, base_from_flange):
        self.arm.servo(base_from_flange, self.period_s)  # returns after one period
        return not self.arm.stopped()

    def wrench(self):
        return self.arm.force_torque()  # at the flange, in its axes; N and N m; raw

    def vacuum(self, on):
        self.arm.set_output(0, on)

    def vacuum_pa(self):
        volts = self.arm.analog_input(0)
        return 20_000.0 * volts if volts is not None else math.nan

    def wrist_depth_m(self):
        return self.on_wrist.depth_mm() / 1000.0  # rectified; aligned to nothing but itself

    def static_depths_m(self):
        return [self.beside.depth_mm() / 1000.0]

    def time_s(self):
        return self.arm.clock_s()


def open_driver():
    return MyRobot()
