// The protocol of `plumbob verify` (docs/protocol.md) for Rust: nothing here needs to be changed.
use std::convert::TryInto;
use std::io::{BufRead, Write};

pub enum Value {
    Null,
    Number(f64),
    Text(String),
    List(Vec<Value>),
    Object(Vec<(String, Value)>),
}

struct Parser<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Parser<'a> {
    fn peek(&mut self) -> u8 {
        while self.at < self.bytes.len() && self.bytes[self.at].is_ascii_whitespace() {
            self.at += 1;
        }
        *self.bytes.get(self.at).unwrap_or(&0)
    }

    fn expect(&mut self, wanted: u8) -> Result<(), String> {
        if self.peek() != wanted {
            return Err(format!("the request is no JSON at byte {}", self.at));
        }
        self.at += 1;
        Ok(())
    }

    fn value(&mut self) -> Result<Value, String> {
        match self.peek() {
            b'{' => {
                let mut members = Vec::new();
                self.list(b'}', |parser| {
                    let name = parser.text()?;
                    parser.expect(b':')?;
                    members.push((name, parser.value()?));
                    Ok(())
                })?;
                Ok(Value::Object(members))
            }
            b'[' => {
                let mut items = Vec::new();
                self.list(b']', |parser| {
                    items.push(parser.value()?);
                    Ok(())
                })?;
                Ok(Value::List(items))
            }
            b'"' => Ok(Value::Text(self.text()?)),
            _ => self.word(),
        }
    }

    fn list<F>(&mut self, end: u8, mut item: F) -> Result<(), String>
    where
        F: FnMut(&mut Self) -> Result<(), String>,
    {
        self.at += 1;
        while self.peek() != end {
            item(self)?;
            if self.peek() != end {
                self.expect(b',')?;
            }
        }
        self.at += 1;
        Ok(())
    }

    // \uXXXX stays as it is: no request needs it.
    fn text(&mut self) -> Result<String, String> {
        self.expect(b'"')?;
        let mut out = Vec::new();
        while self.at < self.bytes.len() && self.bytes[self.at] != b'"' {
            if self.bytes[self.at] == b'\\' {
                self.at += 1;
            }
            out.extend(self.bytes.get(self.at));
            self.at += 1;
        }
        self.at += 1;
        String::from_utf8(out).map_err(|error| error.to_string())
    }

    fn word(&mut self) -> Result<Value, String> {
        let start = self.at;
        while self.at < self.bytes.len() && !b",]} \t\r\n".contains(&self.bytes[self.at]) {
            self.at += 1;
        }
        match std::str::from_utf8(&self.bytes[start..self.at]).unwrap_or("") {
            "null" => Ok(Value::Null),
            "true" => Ok(Value::Number(1.0)),
            "false" => Ok(Value::Number(0.0)),
            word => word.parse().map(Value::Number).map_err(|_| format!("{:?} is no number", word)),
        }
    }
}

pub trait Read: Sized {
    fn read(value: &Value) -> Result<Self, String>;
}

impl Read for f64 {
    fn read(value: &Value) -> Result<Self, String> {
        match value {
            Value::Number(number) => Ok(*number),
            Value::Null => Ok(f64::NAN),
            _ => Err("expected a number".to_string()),
        }
    }
}

impl Read for f32 {
    fn read(value: &Value) -> Result<Self, String> {
        Ok(f64::read(value)? as f32)
    }
}

impl Read for i64 {
    fn read(value: &Value) -> Result<Self, String> {
        Ok(f64::read(value)? as i64)
    }
}

impl Read for usize {
    fn read(value: &Value) -> Result<Self, String> {
        Ok(f64::read(value)? as usize)
    }
}

impl Read for bool {
    fn read(value: &Value) -> Result<Self, String> {
        Ok(f64::read(value)? == 1.0)
    }
}

impl Read for String {
    fn read(value: &Value) -> Result<Self, String> {
        match value {
            Value::Text(text) => Ok(text.clone()),
            _ => Err("expected a text".to_string()),
        }
    }
}

impl<T: Read> Read for Vec<T> {
    fn read(value: &Value) -> Result<Self, String> {
        match value {
            Value::List(items) => items.iter().map(T::read).collect(),
            _ => Err("expected a list".to_string()),
        }
    }
}

impl<T: Read, const N: usize> Read for [T; N] {
    fn read(value: &Value) -> Result<Self, String> {
        let items = Vec::<T>::read(value)?;
        let count = items.len();
        items.try_into().map_err(|_| format!("expected {} items, got {}", N, count))
    }
}

pub trait Show {
    fn show(&self) -> String;
}

// {:?} writes the shortest digits that are read back as the same number.
impl Show for f64 {
    fn show(&self) -> String {
        if self.is_finite() { format!("{:?}", self) } else { "null".to_string() }
    }
}

impl Show for f32 {
    fn show(&self) -> String {
        if self.is_finite() { format!("{:?}", self) } else { "null".to_string() }
    }
}

impl Show for usize {
    fn show(&self) -> String {
        self.to_string()
    }
}

impl Show for bool {
    fn show(&self) -> String {
        self.to_string()
    }
}

impl<T: Show> Show for Vec<T> {
    fn show(&self) -> String {
        format!("[{}]", self.iter().map(T::show).collect::<Vec<_>>().join(","))
    }
}

impl<T: Show, const N: usize> Show for [T; N] {
    fn show(&self) -> String {
        format!("[{}]", self.iter().map(T::show).collect::<Vec<_>>().join(","))
    }
}

pub struct Request(Vec<(String, Value)>);

impl Request {
    pub fn get<T: Read>(&self, name: &str) -> Result<T, String> {
        let found = self.0.iter().find(|(known, _)| known == name);
        let (_, value) = found.ok_or(format!("the request has no {}", name))?;
        T::read(value).map_err(|why| format!("{}: {}", name, why))
    }
}

pub struct System {
    pub masses: Vec<f64>,
    pub springs: Vec<[usize; 2]>,
    pub rest_lengths: Vec<f64>,
    pub stiffnesses: Vec<f64>,
    pub dampings: Vec<f64>,
    pub pinned: Vec<usize>,
    pub gravity: [f64; 3],
}

pub struct Robot {
    pub parents: Vec<i64>,          // -1 is the base
    pub origins: Vec<[f64; 3]>,     // of each joint's frame, in its parent's
    pub orientations: Vec<[f64; 4]>, // of that frame, likewise
    pub axes: Vec<[f64; 3]>,        // in the joint's frame
    pub slides: Vec<bool>,          // along its axis; else the joint rotates about it
    pub lower: Vec<f64>,
    pub upper: Vec<f64>,
    pub effector: usize, // the joint that carries the tool
    pub tool_position: [f64; 3],
    pub tool_rotation: [f64; 4],
    pub urdf: String, // the same robot as a text
}

impl Request {
    pub fn robot(&self) -> Result<Robot, String> {
        Ok(Robot {
            parents: self.get("parents")?,
            origins: self.get("origins")?,
            orientations: self.get("orientations")?,
            axes: self.get("axes")?,
            slides: self.get("slides")?,
            lower: self.get("lower")?,
            upper: self.get("upper")?,
            effector: self.get("effector")?,
            tool_position: self.get("tool_position")?,
            tool_rotation: self.get("tool_rotation")?,
            urdf: self.get("urdf").unwrap_or_default(), // optional
        })
    }
}

impl Request {
    pub fn system(&self) -> Result<System, String> {
        Ok(System {
            masses: self.get("masses")?,
            springs: self.get("springs")?,
            rest_lengths: self.get("rest_lengths")?,
            stiffnesses: self.get("stiffnesses")?,
            dampings: self.get("dampings")?,
            pinned: self.get("pinned")?,
            gravity: self.get("gravity")?,
        })
    }
}

pub fn member<T: Show>(name: &str, value: &T) -> String {
    format!(",\"{}\":{}", name, value.show())
}

// Call the solver; return its outputs, and as a member the time that it takes alone.
pub fn timed<T, F>(call: F) -> Result<(T, String), String>
where
    F: FnOnce() -> Result<T, String>,
{
    let start = std::time::Instant::now();
    let outputs = call()?;
    let seconds = start.elapsed().as_secs_f64();
    Ok((outputs, member("seconds", &seconds)))
}

// Where the answers go. What is printed on standard output from here on goes to the errors.
#[cfg(unix)]
fn take_output() -> std::fs::File {
    use std::os::fd::AsFd;
    extern "C" {
        fn dup2(from: i32, to: i32) -> i32;
    }
    let answers = std::io::stdout().as_fd().try_clone_to_owned().expect("standard output is open");
    unsafe { dup2(2, 1) };
    std::fs::File::from(answers)
}
#[cfg(not(unix))]
fn take_output() -> std::io::Stdout {
    std::io::stdout()
}

fn answered<F>(line: &str, greeting: &str, solve: &F) -> (i64, Result<String, String>)
where
    F: Fn(&str, &Request) -> Result<String, String>,
{
    let request = match (Parser { bytes: line.as_bytes(), at: 0 }).value() {
        Ok(Value::Object(members)) => Request(members),
        Ok(_) => return (-1, Err("the request is no object".to_string())),
        Err(why) => return (-1, Err(why)),
    };
    let task = request.get("task").unwrap_or(String::new());
    let said = if task == "greeting" {
        Ok(format!(",\"protocol\":1,{}", greeting.replace('\n', " ")))
    } else {
        solve(&task, &request)
    };
    (request.get("id").unwrap_or(-1), said)
}

// Answer every request until standard input ends; `greeting` holds members of a JSON object.
pub fn serve<F>(greeting: &str, solve: F)
where
    F: Fn(&str, &Request) -> Result<String, String>,
{
    let mut answers = take_output();
    for line in std::io::stdin().lock().lines().map_while(Result::ok) {
        let (id, said) = answered(&line, greeting, &solve);
        let members = said.unwrap_or_else(|why| {
            let plain = why.replace(|c: char| c == '"' || c == '\\' || c < ' ', "'");
            format!(",\"error\":\"{}\"", plain)
        });
        if writeln!(answers, "{{\"id\":{}{}}}", id, members).and(answers.flush()).is_err() {
            return;
        }
    }
}
