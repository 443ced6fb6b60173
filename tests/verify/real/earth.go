// Right: symplectic Euler with dampers; the gravity of the earth is a constant of the program.
package main

import "math"

var earth = Vec3{0, -9.8, 0}

type State struct{ x, v []Vec3 }

func axpy(a float64, x, y Vec3) Vec3 { return Vec3{a*x[0] + y[0], a*x[1] + y[1], a*x[2] + y[2]} }
func dot(a, b Vec3) float64          { return a[0]*b[0] + a[1]*b[1] + a[2]*b[2] }

func forces(r Request, s State) []Vec3 {
	out := make([]Vec3, len(s.x))
	for i, m := range r.Masses {
		out[i] = axpy(m, earth, Vec3{})
	}
	for k, ends := range r.Springs {
		i, j := ends[0], ends[1]
		d := axpy(-1, s.x[j], s.x[i])
		length := math.Sqrt(dot(d, d))
		u := axpy(1/length, d, Vec3{})
		rate := dot(axpy(-1, s.v[j], s.v[i]), u)
		pull := r.Stiffnesses[k]*(length-r.RestLengths[k]) + r.Dampings[k]*rate
		out[i], out[j] = axpy(-pull, u, out[i]), axpy(pull, u, out[j])
	}
	return out
}

func step(r Request) Outputs {
	s := State{r.Positions, r.Velocities}
	f := forces(r, s)
	held := map[int]bool{}
	for _, i := range r.Pinned {
		held[i] = true
	}
	for i := range s.x {
		if !held[i] {
			s.v[i] = axpy(r.H/r.Masses[i], f[i], s.v[i])
			s.x[i] = axpy(r.H, s.v[i], s.x[i])
		}
	}
	return Outputs{"positions": s.x, "velocities": s.v}
}

func main() {
	serve(Outputs{"name": "earth", "language": "Go", "tasks": []string{"mass_spring_step"}},
		map[string]func(Request) Outputs{"mass_spring_step": step})
}
