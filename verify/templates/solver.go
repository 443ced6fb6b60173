// A starter for `plumbob verify -- ./solver`; plumbob.go speaks the protocol.
// Build: go build -o solver solver.go plumbob.go     Offer only what you have: see main.
package main

// Parents precede children, the root's is -1. An offset is in the parent's frame, the root's is
// its global position. Return the global positions and rotations of all joints.
func forwardKinematics(parents []int, offsets []Vec3, localRotations []Quat) ([]Vec3, []Quat) {
	panic("forward_kinematics is not written yet")
}

// Return local rotations with which the joint `effector` is within `tolerance` of the target, by
// the method "ccd", "fabrik" or another one of the "methods" that main declares, if any.
func inverseKinematics(parents []int, offsets []Vec3, localRotations []Quat, target Vec3,
	effector int, tolerance float64, maxIterations int, method string) []Quat {
	panic("inverse_kinematics is not written yet")
}

// Return positions and velocities a time H later. The request has Masses, Springs (the two
// particles of each), RestLengths, Stiffnesses, Dampings, Pinned (particles that do not move),
// Gravity (an acceleration), Positions, Velocities and H.
func massSpringStep(request Request) ([]Vec3, []Vec3) {
	panic("mass_spring_step is not written yet")
}

// Return coordinates q within Lower and Upper that bring the tool to TargetPosition and
// TargetRotation, from Start. The robot has Parents, Origins, Orientations, Axes, Slides, the
// joint Effector that carries the tool, ToolPosition, ToolRotation, and all of it in Urdf.
func robotInverseKinematics(robot Request) []float64 {
	panic("robot_inverse_kinematics is not written yet")
}

// Return the tool's linear and angular velocity by joint at the coordinates Q: 6 rows.
func robotJacobian(robot Request) [][]float64 {
	panic("robot_jacobian is not written yet")
}

// GREETING_FIELDS
func main() {
	greeting := Outputs{"name": "my solver", "language": "Go", "precision": "double",
		"tasks": []string{"forward_kinematics", "inverse_kinematics", "mass_spring_step",
			"robot_inverse_kinematics", "robot_jacobian"}}
	serve(greeting, map[string]func(Request) Outputs{
		"forward_kinematics": func(r Request) Outputs {
			x, rotations := forwardKinematics(r.Parents, r.Offsets, r.LocalRotations)
			return Outputs{"positions": x, "rotations": rotations}
		},
		"inverse_kinematics": func(r Request) Outputs {
			return Outputs{"local_rotations": inverseKinematics(r.Parents, r.Offsets,
				r.LocalRotations, r.Target, r.Effector, r.Tolerance, r.MaxIterations, r.Method)}
		},
		"mass_spring_step": func(r Request) Outputs {
			x, v := massSpringStep(r)
			return Outputs{"positions": x, "velocities": v}
		},
		"robot_inverse_kinematics": func(r Request) Outputs {
			return Outputs{"q": robotInverseKinematics(r)}
		},
		"robot_jacobian": func(r Request) Outputs {
			return Outputs{"jacobian": robotJacobian(r)}
		},
	})
}
