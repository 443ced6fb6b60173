// CCD on world matrices of all joints; MISTAKE is 0 or 1 to 5.
package main

import (
	"math"
	"os"
)

type Matrix [3]Vec3 // rows

var mistake = os.Getenv("MISTAKE")

func (m Matrix) apply(v Vec3) (out Vec3) {
	for i := range m {
		out[i] = m[i][0]*v[0] + m[i][1]*v[1] + m[i][2]*v[2]
	}
	return out
}

func (m Matrix) transpose() (out Matrix) {
	for i := range m {
		for j := range m {
			out[i][j] = m[j][i]
		}
	}
	return out
}

func (m Matrix) times(n Matrix) (out Matrix) {
	columns := n.transpose()
	for i := range m {
		out[i] = columns.apply(m[i])
	}
	return out
}

func plus(a, b Vec3, s float64) Vec3 {
	return Vec3{a[0] + s*b[0], a[1] + s*b[1], a[2] + s*b[2]}
}

func inner(a, b Vec3) float64 { return a[0]*b[0] + a[1]*b[1] + a[2]*b[2] }

func fromQuat(q Quat) Matrix {
	w, x, y, z := q[0], q[1], q[2], q[3]
	return Matrix{{1 - 2*(y*y+z*z), 2 * (x*y - w*z), 2 * (x*z + w*y)},
		{2 * (x*y + w*z), 1 - 2*(x*x+z*z), 2 * (y*z - w*x)},
		{2 * (x*z - w*y), 2 * (y*z + w*x), 1 - 2*(x*x+y*y)}}
}

func toQuat(m Matrix) Quat {
	s := [4]float64{1 + m[0][0] + m[1][1] + m[2][2], 1 + m[0][0] - m[1][1] - m[2][2],
		1 - m[0][0] + m[1][1] - m[2][2], 1 - m[0][0] - m[1][1] + m[2][2]}
	a, b, c := m[2][1]-m[1][2], m[0][2]-m[2][0], m[1][0]-m[0][1]
	d, e, f := m[1][0]+m[0][1], m[0][2]+m[2][0], m[2][1]+m[1][2]
	rows, best := [4]Quat{{s[0], a, b, c}, {a, s[1], d, e}, {b, d, s[2], f}, {c, e, f, s[3]}}, 0
	for i := range s {
		if s[i] > s[best] {
			best = i
		}
	}
	q := rows[best]
	n := math.Sqrt(q[0]*q[0] + q[1]*q[1] + q[2]*q[2] + q[3]*q[3])
	return Quat{q[0] / n, q[1] / n, q[2] / n, q[3] / n}
}

func rodrigues(a, b Vec3) Matrix {
	u, v := plus(Vec3{}, a, 1/math.Sqrt(inner(a, a))), plus(Vec3{}, b, 1/math.Sqrt(inner(b, b)))
	k, c := Vec3{u[1]*v[2] - u[2]*v[1], u[2]*v[0] - u[0]*v[2], u[0]*v[1] - u[1]*v[0]}, inner(u, v)
	if mistake == "1" { // the axis points the other way: it turns away
		k = Vec3{-k[0], -k[1], -k[2]}
	}
	f, m := 1/(1+c), Matrix{{c, -k[2], k[1]}, {k[2], c, -k[0]}, {-k[1], k[0], c}}
	for i := range m {
		m[i] = plus(m[i], k, f*k[i])
	}
	return m
}

type Arm struct {
	parents  []int
	offsets  []Vec3
	local    []Matrix
	place    []Vec3
	world    []Matrix
	effector int
}

func (a *Arm) update() {
	for j, p := range a.parents {
		if p < 0 {
			a.place[j], a.world[j] = a.offsets[j], a.local[j]
		} else {
			a.place[j] = plus(a.place[p], a.world[p].apply(a.offsets[j]), 1)
			a.world[j] = a.world[p].times(a.local[j])
		}
	}
}

func (a *Arm) bend(j, child int, target Vec3) {
	turn := rodrigues(plus(a.place[a.effector], a.place[j], -1), plus(target, a.place[j], -1))
	if mistake == "2" { // the rotation is applied to the child
		j = child
	}
	world := turn.times(a.world[j])
	if mistake == "3" { // on the right
		world = a.world[j].times(turn)
	}
	a.local[j] = world
	if p := a.parents[j]; p >= 0 {
		a.local[j] = a.world[p].transpose().times(world)
	}
}

func solve(r Request) Outputs {
	n := len(r.Parents)
	a := Arm{r.Parents, r.Offsets, make([]Matrix, n), make([]Vec3, n), make([]Matrix, n), r.Effector}
	for j, q := range r.LocalRotations {
		a.local[j] = fromQuat(q)
	}
	if mistake == "4" { // always the last joint
		a.effector = n - 1
	}
	a.update()
	for i := 0; i < r.MaxIterations; i++ {
		for child := a.effector; r.Parents[child] >= 0; child = r.Parents[child] {
			a.bend(r.Parents[child], child, r.Target)
			if mistake != "5" || r.Parents[r.Parents[child]] >= 0 { // 5: not after the root's turn
				a.update()
			}
		}
		miss := plus(a.place[a.effector], r.Target, -1)
		if inner(miss, miss) <= r.Tolerance*r.Tolerance {
			break
		}
	}
	rotations := make([]Quat, n)
	for j := range rotations {
		rotations[j] = toQuat(a.local[j])
	}
	return Outputs{"local_rotations": rotations, "positions": a.place}
}

func main() {
	serve(Outputs{"name": "matrices", "language": "Go", "tasks": []string{"inverse_kinematics"},
		"methods": []string{"ccd"}}, map[string]func(Request) Outputs{"inverse_kinematics": solve})
}
