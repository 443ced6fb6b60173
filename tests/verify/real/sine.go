// CCD by Rodrigues' formula; the length of the cross product, a sine, is taken for the angle.
package main

import "math"

type Joint struct {
	parent      int
	offset, pos Vec3
	local, glob Quat
}

func cross(a, b Vec3) Vec3 {
	return Vec3{a[1]*b[2] - a[2]*b[1], a[2]*b[0] - a[0]*b[2], a[0]*b[1] - a[1]*b[0]}
}

func sub(a, b Vec3) Vec3           { return Vec3{a[0] - b[0], a[1] - b[1], a[2] - b[2]} }
func norm(a Vec3) float64          { return math.Sqrt(a[0]*a[0] + a[1]*a[1] + a[2]*a[2]) }
func scale(a Vec3, s float64) Vec3 { return Vec3{a[0] * s, a[1] * s, a[2] * s} }
func conj(q Quat) Quat             { return Quat{q[0], -q[1], -q[2], -q[3]} }

func mul(a, b Quat) Quat {
	return Quat{a[0]*b[0] - a[1]*b[1] - a[2]*b[2] - a[3]*b[3],
		a[0]*b[1] + a[1]*b[0] + a[2]*b[3] - a[3]*b[2],
		a[0]*b[2] - a[1]*b[3] + a[2]*b[0] + a[3]*b[1],
		a[0]*b[3] + a[1]*b[2] - a[2]*b[1] + a[3]*b[0]}
}

func update(joints []*Joint) {
	for _, j := range joints {
		j.pos, j.glob = j.offset, j.local
		if j.parent >= 0 {
			up := joints[j.parent]
			p := mul(mul(up.glob, Quat{0, j.offset[0], j.offset[1], j.offset[2]}), conj(up.glob))
			j.pos = Vec3{up.pos[0] + p[1], up.pos[1] + p[2], up.pos[2] + p[3]}
			j.glob = mul(up.glob, j.local)
		}
	}
}

func turn(joints []*Joint, j *Joint, tip *Joint, target Vec3) {
	a, b := sub(tip.pos, j.pos), sub(target, j.pos)
	axis := cross(scale(a, 1/norm(a)), scale(b, 1/norm(b)))
	angle := norm(axis)
	if angle < 1e-10 {
		return
	}
	axis = scale(axis, math.Sin(angle/2)/angle)
	q := mul(Quat{math.Cos(angle / 2), axis[0], axis[1], axis[2]}, j.glob)
	if j.parent >= 0 {
		q = mul(conj(joints[j.parent].glob), q)
	}
	j.local = q
	update(joints)
}

func inverseKinematics(r Request) Outputs {
	var joints []*Joint
	for i, parent := range r.Parents {
		joints = append(joints, &Joint{parent: parent, offset: r.Offsets[i], local: r.LocalRotations[i]})
	}
	update(joints)
	tip, sweeps := joints[r.Effector], 0
	for sweeps < r.MaxIterations {
		for j := tip.parent; j >= 0; j = joints[j].parent {
			turn(joints, joints[j], tip, r.Target)
		}
		sweeps++
		if norm(sub(tip.pos, r.Target)) <= r.Tolerance {
			break
		}
	}
	local := make([]Quat, len(joints))
	for i, j := range joints {
		local[i] = j.local
	}
	return Outputs{"local_rotations": local, "iterations": sweeps}
}

func main() {
	serve(Outputs{"name": "joints", "language": "Go", "tasks": []string{"inverse_kinematics"},
		"methods": []string{"ccd"}},
		map[string]func(Request) Outputs{"inverse_kinematics": inverseKinematics})
}
