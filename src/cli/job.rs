//! A job of `glimt batch`: a JSON object whose keys are options of `glimt render` → the arguments of `glimt render`.
//!
//! The arguments are parsed as those of the command line are, so that a job has every option, with the same messages.

use super::render::RenderArgs;
use super::{one_line, values};
use clap::{CommandFactory, Parser};
use serde_json::{Map, Value};
use std::path::Path;
use std::time::Duration;

/// Options that are the whole batch's, or have no meaning in it, and why.
const REFUSED: [(&str, &str); 7] = [
    ("json", "every answer has the report"),
    ("quiet", "a job prints its answer and nothing else"),
    ("frames", "a job is one picture: give each frame's time as 'at'"),
    ("fps", "a job is one picture: give each frame's time as 'at'"),
    ("device", "the whole batch has one: glimt batch --device"),
    ("threads", "the whole batch has them: glimt batch --threads"),
    ("validate", "it is for the whole batch: glimt batch --validate"),
];

/// Limits of a job that says nothing else.
#[derive(clap::Args, Default)]
pub struct LimitArgs {
    /// Stop a job after so many seconds: its file is not written. Looked at between steps of loading and between the waves of
    /// samples of a picture, none of which is interrupted [key of a job: timeout]
    #[arg(long, value_name = "SECONDS", value_parser = values::seconds)]
    timeout: Option<Duration>,
    /// Memory that reading a job's file may take: bytes, or with K, M or G [default: 2G] [key of a job: max-memory]
    #[arg(long, value_name = "SIZE", value_parser = values::bytes)]
    max_memory: Option<u64>,
    /// Refuse a job's scene if it has more triangles, all instances counted [key of a job: max-triangles]
    #[arg(long, value_name = "N")]
    max_triangles: Option<u64>,
}

/// One picture to make.
pub struct Job {
    /// Time that it may take.
    pub timeout: Option<Duration>,
    /// What `glimt render` would be told.
    pub render: RenderArgs,
}

#[derive(Parser)]
#[command(no_binary_name = true, disable_help_flag = true)]
struct Arguments {
    #[command(flatten)]
    render: RenderArgs,
}

/// The job of a line and its id, which is known even where the job is wrong.
pub fn read(line: &[u8], limits: &LimitArgs) -> (Value, Result<Job, String>) {
    let object = match serde_json::from_slice(line) {
        Ok(Value::Object(object)) => object,
        Ok(_) => return (Value::Null, Err("a job must be a JSON object, as in {\"scene\": \"model.glb\"}".into())),
        Err(error) => return (Value::Null, Err(format!("not JSON: {error}"))),
    };
    let mut options: Map<String, Value> = Map::new();
    for (key, value) in object {
        let name = key.replace('_', "-");
        if options.insert(name, value).is_some() {
            return (Value::Null, Err(format!("'{key}' is given twice, with - and with _")));
        }
    }
    let id = options.remove("id").unwrap_or_default();
    (id, job(options, limits))
}

fn job(mut options: Map<String, Value>, limits: &LimitArgs) -> Result<Job, String> {
    let timeout = match options.remove("timeout").filter(is_given) {
        Some(value) => {
            Some(values::seconds(&text("timeout", &value, ",")?).map_err(|why| format!("'timeout': {why}"))?)
        }
        None => limits.timeout,
    };
    for (key, limit) in [("max-memory", limits.max_memory), ("max-triangles", limits.max_triangles)] {
        if let (Some(limit), false) = (limit, options.get(key).is_some_and(is_given)) {
            options.insert(key.into(), limit.into());
        }
    }
    let arguments = arguments(&options)?;
    let Arguments { render } = Arguments::try_parse_from(arguments).map_err(|error| one_line(&error))?;
    if render.scene == "-" {
        return Err("'scene': standard input is the jobs'; give a file".into());
    }
    if render.output.as_deref() == Some(Path::new("-")) {
        return Err("'output': standard output is the answers'; give a file".into());
    }
    Ok(Job { timeout, render })
}

/// What would be typed.
fn arguments(options: &Map<String, Value>) -> Result<Vec<String>, String> {
    let command = Arguments::command();
    let (mut typed, mut scene) = (Vec::new(), Vec::new());
    for (key, value) in options {
        if let Some((_, why)) = REFUSED.iter().find(|(refused, _)| refused == key) {
            return Err(format!("'{key}' is not for a job: {why}"));
        }
        if key.is_empty() || !key.bytes().all(|byte| byte.is_ascii_alphanumeric() || byte == b'-') {
            return Err(format!("'{key}' is no name of an option"));
        }
        if key == "scene" {
            if is_given(value) {
                scene = vec!["--".into(), text(key, value, ",")?];
            }
            continue;
        }
        // An unknown name is typed as it is: the parser knows what was meant.
        let known =
            command.get_arguments().find(|known| known.get_long() == Some(key) || is_choice_of_scene(known, key));
        let name = known.and_then(|known| known.get_long()).unwrap_or(key);
        let takes_value = known.is_some_and(|known| known.get_action().takes_values());
        match value {
            Value::Null | Value::Bool(false) if known.is_some() => {}
            Value::Null | Value::Bool(_) if !takes_value => typed.push(format!("--{name}")),
            _ => {
                let is_size =
                    |known: &clap::Arg| known.get_value_names().is_some_and(|names| names.iter().any(|n| n == "WxH"));
                let between = if known.is_some_and(is_size) { "x" } else { "," };
                typed.push(format!("--{name}={}", text(key, value, between)?));
            }
        }
    }
    typed.extend(scene);
    Ok(typed)
}

/// The file has the key `scene`, so that its scene, `--scene` on the command line, needs another.
fn is_choice_of_scene(argument: &clap::Arg, key: &str) -> bool {
    key == "scene-choice" && argument.get_id() == "scene_choice"
}

/// Not `null`, not `false`.
fn is_given(value: &Value) -> bool {
    !matches!(value, Value::Null | Value::Bool(false))
}

/// A value as it would be typed.
fn text(key: &str, value: &Value, between: &str) -> Result<String, String> {
    match value {
        Value::String(text) => Ok(text.clone()),
        Value::Number(number) => Ok(number.to_string()),
        Value::Bool(value) => Ok(value.to_string()),
        Value::Array(parts) if !parts.iter().any(|part| part.is_array()) => {
            let parts: Vec<String> = parts.iter().map(|part| text(key, part, between)).collect::<Result<_, _>>()?;
            Ok(parts.join(between))
        }
        _ => Err(format!("'{key}': must be a string, a number, true, false, null or a list of numbers")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn typed(options: Value) -> Result<Vec<String>, String> {
        options.as_object().ok_or_else(String::new).and_then(arguments)
    }

    fn fault(job: Value) -> String {
        read(job.to_string().as_bytes(), &LimitArgs::default()).1.err().unwrap_or_default()
    }

    #[test]
    fn keys_are_options() {
        let options = json!({"spp": 4, "strict": true, "quiet-not": null, "scene": "-a.glb", "scene-choice": 1});
        assert_eq!(typed(options).unwrap(), ["--quiet-not", "--scene=1", "--spp=4", "--strict", "--", "-a.glb"]);
        let options = json!({"size": [3, 4], "eye": [1, -2, 0.5], "orbit": "1,2,3", "strict": false, "fov": null});
        assert_eq!(typed(options).unwrap(), ["--eye=1,-2,0.5", "--orbit=1,2,3", "--size=3x4"]);
        let (id, job) =
            read(br#"{"id": [1], "max_depth": 3, "timeout": 2.5, "output": "x.exr"}"#, &LimitArgs::default());
        let job = job.unwrap_or_else(|fault| panic!("{fault}"));
        assert_eq!((id, job.timeout), (json!([1]), Some(Duration::from_millis(2500))));
        assert_eq!((job.render.scene.as_str(), job.render.output.as_deref()), ("table", Some(Path::new("x.exr"))));
    }

    #[test]
    fn limits_are_defaults() {
        let limits = LimitArgs { timeout: values::seconds("9").ok(), max_memory: Some(1000), max_triangles: Some(7) };
        let triangles = |job: &str| {
            let job = read(job.as_bytes(), &limits).1.unwrap_or_else(|fault| panic!("{fault}"));
            (job.timeout.map(|time| time.as_secs()), job.render.view.options().unwrap().max_triangles)
        };
        assert_eq!(triangles("{}"), (Some(9), Some(7)));
        assert_eq!(triangles(r#"{"timeout": null, "max-triangles": null}"#), (Some(9), Some(7)));
        assert_eq!(triangles(r#"{"timeout": "3", "max_triangles": 8}"#), (Some(3), Some(8)));
    }

    #[test]
    fn what_a_job_may_not_say() {
        for (key, _) in REFUSED {
            assert!(fault(json!({key: true})).contains("is not for a job"), "{key}");
        }
        assert!(
            fault(json!({"sppp": 4})).contains("a similar argument exists: '--spp'"),
            "{}",
            fault(json!({"sppp": 4}))
        );
        assert!(fault(json!({"nonsense": false})).contains("'--nonsense'"));
        assert!(fault(json!({"spp": "many"})).contains("'many'"));
        assert!(fault(json!({"spp": true})).contains("'true'"));
        assert!(fault(json!({"strict": "yes"})).contains("'yes'"));
        assert!(fault(json!({"eye": [0, 0, 1], "orbit": [0, 0, 1]})).contains("cannot be used with"));
        assert!(fault(json!({"eye": {"x": 1}})).contains("must be a string"));
        assert!(fault(json!({"help": true})).contains("'--help'"));
        assert!(fault(json!({"version": true})).contains("'--version'"));
        assert!(fault(json!({"device=reference": true})).contains("no name"));
        assert!(fault(json!({"": true})).contains("no name"));
        assert!(fault(json!({"scene": "-"})).contains("standard input"));
        assert!(fault(json!({"output": ["-"]})).contains("standard output"));
        assert!(fault(json!({"max-depth": 1, "max_depth": 2})).contains("given twice"));
        assert!(fault(json!({"timeout": 0})).contains("'timeout'"));
        assert!(fault(json!([1])).contains("must be a JSON object"));
        assert!(read(b"{", &LimitArgs::default()).1.is_err_and(|fault| fault.starts_with("not JSON")));
    }
}
