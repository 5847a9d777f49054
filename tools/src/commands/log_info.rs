//! What `palpate log` prints: a log's contents as text and as JSON.

use palpate::log::{Environment, LoggedExecution};
use palpate::printable;
use serde_json::{Value, json};

use crate::log_file::LogInfo;

/// A number of bytes in words.
pub fn bytes(bytes: u64) -> String {
    match bytes {
        0..10_000 => format!("{bytes} bytes"),
        10_000..10_000_000 => format!("{:.1} kB", bytes as f64 / 1e3),
        _ => format!("{:.1} MB", bytes as f64 / 1e6),
    }
}

/// A count with its unit.
pub fn count(count: u64, one: &str, many: &str) -> String {
    format!("{count} {}", if count == 1 { one } else { many })
}

/// A time in seconds.
pub fn seconds(ns: u64) -> String {
    format!("{:.3}", ns as f64 * 1e-9)
}

/// The time that messages cover, in words.
pub fn span(span: Option<(u64, u64)>) -> String {
    span.map_or("over no time".to_owned(), |(first, last)| format!("over {} s", seconds(last.saturating_sub(first))))
}

/// The contents as text.
pub fn to_text(info: &LogInfo, place: &str) -> String {
    let how = match (info.has_index, info.damage.len()) {
        (true, _) => "complete, by its index".to_owned(),
        (false, 0) => "complete, without an index".to_owned(),
        (false, 1) => "not complete: read up to the damage".to_owned(),
        (false, places) => format!("not complete: damaged at {places} places"),
    };
    let mut lines = vec![
        format!("{place}: {}, {how}", bytes(info.bytes)),
        format!("duration   {:.3} s, {}", info.duration_s(), count(info.messages, "message", "messages")),
    ];
    let named = [info.library.as_str(), info.profile.as_str()].into_iter().filter(|name| !name.is_empty());
    let named: Vec<&str> = named.collect();
    if !named.is_empty() {
        lines.push(format!("written by {}", printable(&named.join(", profile "))));
    }
    for (compression, chunks) in &info.chunks {
        let ratio = chunks.unpacked as f64 / (chunks.packed as f64).max(1.0);
        let (packed, unpacked) = (bytes(chunks.packed), bytes(chunks.unpacked));
        let number = count(chunks.count, "chunk", "chunks");
        let compression = printable(compression);
        lines.push(format!("chunks     {number}, {compression}: {packed} of {unpacked} unpacked, {ratio:.1} to 1"));
    }
    if let Some(environment) = &info.environment {
        lines.extend(run(environment));
    }
    let names: Vec<_> = info.topics.keys().map(|name| printable(name)).collect();
    let width = names.iter().map(|name| name.chars().count()).max().unwrap_or(0).max(5);
    lines.push(format!("\n{:width$} {:>10} {:>10}  message", "topic", "messages", "rate (Hz)"));
    for (name, topic) in names.iter().zip(info.topics.values()) {
        let rate = info.rate_hz(topic).map_or("-".to_owned(), |rate| format!("{rate:.1}"));
        let message = if topic.schema.is_empty() { &topic.encoding } else { &topic.schema };
        lines.push(format!("{name:width$} {:>10} {rate:>10}  {}", topic.messages, printable(message)));
    }
    let attachments = info.attachments.iter().map(|one| format!("{} ({})", printable(&one.name), bytes(one.bytes)));
    let attachments: Vec<String> = attachments.collect();
    if !attachments.is_empty() {
        lines.push(format!("\nattached   {}", attachments.join(", ")));
    }
    lines.join("\n") + "\n"
}

/// What palpate knows of a run.
fn run(environment: &Environment) -> Vec<String> {
    let Environment { palpate_version, instruction_set, model, .. } = environment;
    let execution = execution(environment);
    let groups = environment.groups.iter().map(|group| format!("{} {} Hz", printable(&group.name), group.rate_hz));
    let [palpate_version, instruction_set, model] =
        [palpate_version, instruction_set, model].map(|name| printable(name));
    let mut lines = vec![
        format!("run        {execution}, model {model}, palpate {palpate_version}, {instruction_set}"),
        format!("groups     {}", groups.collect::<Vec<_>>().join(", ")),
    ];
    if !environment.devices.is_empty() {
        lines.push(format!("devices    {}", printable(&environment.devices.join(", "))));
    }
    for (i, (what, granted)) in environment.granted.iter().enumerate() {
        let granted = printable(&format!("{what}: {granted}")).into_owned();
        lines.push(format!("{:10} {granted}", if i == 0 { "granted" } else { "" }));
    }
    lines
}

fn execution(environment: &Environment) -> &'static str {
    match environment.execution {
        LoggedExecution::Virtual => "virtual",
        LoggedExecution::Threaded { .. } => "threaded",
    }
}

/// The contents as one JSON document. Later versions only add fields.
pub fn to_json(info: &LogInfo) -> Value {
    let chunks = info.chunks.iter().map(|(compression, chunks)| {
        let mut chunks = json!(chunks);
        chunks["compression"] = json!(compression);
        chunks
    });
    let topics = info.topics.iter().map(|(name, topic)| {
        let rate_hz = info.rate_hz(topic);
        let mut topic = json!(topic);
        (topic["topic"], topic["rate_hz"]) = (json!(name), json!(rate_hz));
        topic
    });
    json!({
        "schema_version": 1,
        "bytes": info.bytes,
        "complete": info.damage.is_empty(),
        "has_index": info.has_index,
        "damage": info.damage,
        "library": info.library,
        "profile": info.profile,
        "messages": info.messages,
        "first_log_time_ns": info.span.map(|span| span.0),
        "last_log_time_ns": info.span.map(|span| span.1),
        "duration_s": info.duration_s(),
        "chunks": chunks.collect::<Vec<_>>(),
        "topics": topics.collect::<Vec<_>>(),
        "attachments": info.attachments,
        "metadata": info.metadata,
        "environment": info.environment.as_ref().map(environment_json),
    })
}

fn environment_json(environment: &Environment) -> Value {
    let groups = environment
        .groups
        .iter()
        .map(|group| json!({"name": group.name, "rate_hz": group.rate_hz, "background": group.background}));
    json!({
        "execution": execution(environment),
        "start_unix_ns": environment.epoch_ns(),
        "model": environment.model,
        "palpate_version": environment.palpate_version,
        "instruction_set": environment.instruction_set,
        "groups": groups.collect::<Vec<_>>(),
        "devices": environment.devices,
        "granted": environment.granted,
    })
}
