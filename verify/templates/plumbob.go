// The protocol of `plumbob verify` (docs/protocol.md) for Go: nothing here needs to be changed.
package main

import (
	"bufio"
	"encoding/json"
	"fmt"
	"io"
	"math"
	"os"
	"reflect"
	"strconv"
	"strings"
	"time"
)

type Vec3 = [3]float64 // [m]
type Quat = [4]float64 // unit quaternion, w first
type Outputs = map[string]any

type Request struct {
	Id                int       `json:"id"`
	Task              string    `json:"task"`
	Parents           []int     `json:"parents"`
	Offsets           []Vec3    `json:"offsets"`
	LocalRotations    []Quat    `json:"local_rotations"`
	Target            Vec3      `json:"target"`
	Effector          int       `json:"effector"`
	Tolerance         float64   `json:"tolerance"`
	MaxIterations     int       `json:"max_iterations"`
	Method            string    `json:"method"`
	Masses            []float64 `json:"masses"`
	Springs           [][2]int  `json:"springs"`
	RestLengths       []float64 `json:"rest_lengths"`
	Stiffnesses       []float64 `json:"stiffnesses"`
	Dampings          []float64 `json:"dampings"`
	Pinned            []int     `json:"pinned"`
	Gravity           Vec3      `json:"gravity"`
	Positions         []Vec3    `json:"positions"`
	Velocities        []Vec3    `json:"velocities"`
	H                 float64   `json:"h"`
	Origins           []Vec3    `json:"origins"`
	Orientations      []Quat    `json:"orientations"`
	Axes              []Vec3    `json:"axes"`
	Slides            []bool    `json:"slides"`
	Lower             []float64 `json:"lower"`
	Upper             []float64 `json:"upper"`
	ToolPosition      Vec3      `json:"tool_position"`
	ToolRotation      Quat      `json:"tool_rotation"`
	Urdf              string    `json:"urdf"`
	Q                 []float64 `json:"q"`
	Start             []float64 `json:"start"`
	TargetPosition    Vec3      `json:"target_position"`
	TargetRotation    Quat      `json:"target_rotation"`
	ToleranceRotation float64   `json:"tolerance_rotation"`
}

// Return JSON; a number that is not finite becomes null, which encoding/json refuses to write.
func encode(value reflect.Value) string {
	switch value.Kind() {
	case reflect.Interface:
		return encode(value.Elem())
	case reflect.Slice, reflect.Array:
		items := make([]string, value.Len())
		for i := range items {
			items[i] = encode(value.Index(i))
		}
		return "[" + strings.Join(items, ",") + "]"
	case reflect.Map:
		var members []string
		for _, key := range value.MapKeys() {
			members = append(members, strconv.Quote(key.String())+":"+encode(value.MapIndex(key)))
		}
		return "{" + strings.Join(members, ",") + "}"
	case reflect.Float32, reflect.Float64:
		if number := value.Float(); math.IsNaN(number) || math.IsInf(number, 0) {
			return "null"
		}
	}
	text, _ := json.Marshal(value.Interface())
	return string(text)
}

// Call the solver, and set the time that it takes alone; a panic is the answer's error.
func timed(solve func(Request) Outputs, request Request) (outputs Outputs) {
	defer func() {
		if failure := recover(); failure != nil {
			outputs = Outputs{"error": fmt.Sprint(failure)}
		}
	}()
	start := time.Now()
	outputs = solve(request)
	outputs["seconds"] = time.Since(start).Seconds()
	return outputs
}

// Answer every request until standard input ends.
func serve(greeting Outputs, solvers map[string]func(Request) Outputs) {
	answers := os.Stdout
	os.Stdout = os.Stderr // what else is printed goes to the errors and does no harm
	lines := bufio.NewReader(os.Stdin)
	for {
		line, err := lines.ReadBytes('\n')
		if err == io.EOF && len(line) == 0 {
			return
		}
		var request Request
		outputs := Outputs{}
		if failure := json.Unmarshal(line, &request); failure != nil {
			outputs["error"] = failure.Error()
		} else if request.Task == "greeting" {
			outputs["protocol"] = 1
			for name, value := range greeting {
				outputs[name] = value
			}
		} else if solver, offered := solvers[request.Task]; offered {
			outputs = timed(solver, request)
		} else {
			outputs["error"] = request.Task + " is not offered"
		}
		outputs["id"] = request.Id
		fmt.Fprintln(answers, encode(reflect.ValueOf(outputs)))
	}
}
