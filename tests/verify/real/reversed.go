// Frames of 3 x 3 matrices in a slice; a child's rotation stands on the left of its parent's.
package main

import "math"

type Mat [3][3]float64

type Frame struct {
	basis  Mat
	origin Vec3
}

func (m Mat) Mul(n Mat) (out Mat) {
	for i := range m {
		for j := range n {
			for k := range n {
				out[i][j] += m[i][k] * n[k][j]
			}
		}
	}
	return out
}

func (f Frame) Point(v Vec3) (out Vec3) {
	for i, row := range f.basis {
		out[i] = f.origin[i] + row[0]*v[0] + row[1]*v[1] + row[2]*v[2]
	}
	return out
}

func FromQuat(q Quat) Mat {
	w, x, y, z := q[0], q[1], q[2], q[3]
	return Mat{
		{w*w + x*x - y*y - z*z, 2 * (x*y - w*z), 2 * (x*z + w*y)},
		{2 * (x*y + w*z), w*w - x*x + y*y - z*z, 2 * (y*z - w*x)},
		{2 * (x*z - w*y), 2 * (y*z + w*x), w*w - x*x - y*y + z*z},
	}
}

func ToQuat(m Mat) Quat {
	t := m[0][0] + m[1][1] + m[2][2]
	q := Quat{1 + t, m[2][1] - m[1][2], m[0][2] - m[2][0], m[1][0] - m[0][1]}
	for i := 0; i < 3; i++ {
		if diagonal := m[i][i]; diagonal > t && 1+2*diagonal-t > q[0] {
			j, k := (i+1)%3, (i+2)%3
			q[0] = m[k][j] - m[j][k]
			q[1+i] = 1 + 2*diagonal - t
			q[1+j] = m[j][i] + m[i][j]
			q[1+k] = m[k][i] + m[i][k]
			break
		}
	}
	n := math.Sqrt(q[0]*q[0] + q[1]*q[1] + q[2]*q[2] + q[3]*q[3])
	return Quat{q[0] / n, q[1] / n, q[2] / n, q[3] / n}
}

func forwardKinematics(r Request) Outputs {
	frames := make([]Frame, len(r.Parents))
	positions, rotations := make([]Vec3, len(frames)), make([]Quat, len(frames))
	for j, parent := range r.Parents {
		local := FromQuat(r.LocalRotations[j])
		if parent < 0 {
			frames[j] = Frame{local, r.Offsets[j]}
		} else {
			frames[j] = Frame{local.Mul(frames[parent].basis), frames[parent].Point(r.Offsets[j])}
		}
		positions[j], rotations[j] = frames[j].origin, ToQuat(frames[j].basis)
	}
	return Outputs{"positions": positions, "rotations": rotations}
}

func main() {
	serve(Outputs{"name": "frames", "language": "Go", "tasks": []string{"forward_kinematics"}},
		map[string]func(Request) Outputs{"forward_kinematics": forwardKinematics})
}
