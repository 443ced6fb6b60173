// A starter for `plumbob verify -- ./solver`; plumbob.rs speaks the protocol.
// Build: rustc -O solver.rs     Offer only what you have: see GREETING.
#![allow(unused)]
mod plumbob;
use plumbob::{member, timed, Request, Robot, System};

type Vec3 = [f64; 3]; // [m]
type Quat = [f64; 4]; // unit quaternion, w first

// GREETING_FIELDS
const GREETING: &str = r#""name": "my solver", "language": "Rust", "precision": "double",
    "tasks": ["forward_kinematics", "inverse_kinematics", "mass_spring_step",
    "robot_inverse_kinematics", "robot_jacobian"]"#;

// Parents precede children, the root's is -1. An offset is in the parent's frame, the root's is
// its global position. Return the global positions and rotations of all joints.
fn forward_kinematics(parents: &[i64], offsets: &[Vec3], local_rotations: &[Quat])
    -> Result<(Vec<Vec3>, Vec<Quat>), String> {
    Err("forward_kinematics is not written yet".into())
}

// Return local rotations with which the joint `effector` is within `tolerance` of the target, by
// the method "ccd", "fabrik" or another one of the "methods" in GREETING, if any.
fn inverse_kinematics(parents: &[i64], offsets: &[Vec3], local_rotations: &[Quat], target: Vec3,
    effector: usize, tolerance: f64, max_iterations: usize, method: &str)
    -> Result<Vec<Quat>, String> {
    Err("inverse_kinematics is not written yet".into())
}

// The system has masses, springs (the two particles of each), rest_lengths, stiffnesses, dampings,
// pinned (particles that do not move) and gravity (an acceleration): see plumbob.rs.
// Return positions and velocities a time h later.
fn mass_spring_step(system: &System, positions: Vec<Vec3>, velocities: Vec<Vec3>, h: f64)
    -> Result<(Vec<Vec3>, Vec<Vec3>), String> {
    Err("mass_spring_step is not written yet".into())
}

// The robot has parents, origins, orientations, axes, slides, limits, the joint `effector` that
// carries the tool, tool_position, tool_rotation, and all of it in urdf: see plumbob.rs. Return
// coordinates within the limits that bring the tool to a position and a rotation.
fn robot_inverse_kinematics(robot: &Robot, start: &[f64], position: Vec3, rotation: Quat,
    tolerance: f64, tolerance_rotation: f64, max_iterations: usize) -> Result<Vec<f64>, String> {
    Err("robot_inverse_kinematics is not written yet".into())
}

// Return the tool's linear and angular velocity by joint: 6 rows.
fn robot_jacobian(robot: &Robot, q: &[f64]) -> Result<Vec<Vec<f64>>, String> {
    Err("robot_jacobian is not written yet".into())
}

fn solve_robot(task: &str, request: &Request) -> Result<String, String> {
    let robot = request.robot()?;
    if task == "robot_jacobian" {
        let q: Vec<_> = request.get("q")?;
        let (jacobian, seconds) = timed(|| robot_jacobian(&robot, &q))?;
        return Ok(member("jacobian", &jacobian) + &seconds);
    }
    let start: Vec<_> = request.get("start")?;
    let (position, rotation) = (request.get("target_position")?, request.get("target_rotation")?);
    let (close, narrow) = (request.get("tolerance")?, request.get("tolerance_rotation")?);
    let limit = request.get("max_iterations")?;
    let (q, seconds) = timed(|| robot_inverse_kinematics(&robot, &start, position, rotation,
        close, narrow, limit))?;
    Ok(member("q", &q) + &seconds)
}

fn solve(task: &str, request: &Request) -> Result<String, String> {
    if task.starts_with("robot") {
        return solve_robot(task, request);
    }
    if task == "mass_spring_step" {
        let system = request.system()?;
        let (x, v, h) = (request.get("positions")?, request.get("velocities")?, request.get("h")?);
        let ((x, v), seconds) = timed(|| mass_spring_step(&system, x, v, h))?;
        return Ok(member("positions", &x) + &member("velocities", &v) + &seconds);
    }
    let (parents, offsets): (Vec<_>, Vec<_>) = (request.get("parents")?, request.get("offsets")?);
    let local: Vec<_> = request.get("local_rotations")?;
    if task == "forward_kinematics" {
        let ((x, r), seconds) = timed(|| forward_kinematics(&parents, &offsets, &local))?;
        return Ok(member("positions", &x) + &member("rotations", &r) + &seconds);
    }
    let (target, effector) = (request.get("target")?, request.get("effector")?);
    let (tolerance, max_iterations) = (request.get("tolerance")?, request.get("max_iterations")?);
    let method: String = request.get("method")?;
    let (local, seconds) = timed(|| inverse_kinematics(&parents, &offsets, &local, target,
        effector, tolerance, max_iterations, &method))?;
    Ok(member("local_rotations", &local) + &seconds)
}

fn main() {
    plumbob::serve(GREETING, solve)
}
