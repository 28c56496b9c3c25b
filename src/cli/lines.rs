//! The lines of standard input, for commands that answer line by line.

use std::io::{BufRead, Read};
use std::sync::mpsc;

/// Most bytes of a line.
const LONGEST_LINE: u64 = 1 << 20;

/// A line of standard input that is not empty.
pub struct Line {
    /// Counted from 1, empty ones too.
    pub number: u64,
    /// Its bytes, or why they cannot be had.
    pub text: Result<Vec<u8>, String>,
}

/// The lines of standard input, read by a thread of their own: it waits for the next while Ctrl-C is looked at.
pub fn lines() -> mpsc::Receiver<Line> {
    let (sender, lines) = mpsc::sync_channel(4);
    std::thread::spawn(move || read_lines(std::io::stdin().lock(), |line| sender.send(line).is_ok()));
    lines
}

/// Hands on each line that is not empty, while somebody takes them.
fn read_lines(mut input: impl BufRead, mut hand_on: impl FnMut(Line) -> bool) {
    let mut number = 0;
    loop {
        number += 1;
        let (text, is_last) = match read_line(&mut input) {
            Ok(Some(text)) if text.len() as u64 > LONGEST_LINE => {
                (Err(format!("the line is longer than {LONGEST_LINE} bytes")), false)
            }
            Ok(Some(text)) if text.trim_ascii().is_empty() => continue,
            Ok(Some(text)) => (Ok(text), false),
            Ok(None) => return,
            Err(error) => (Err(format!("cannot read standard input: {error}")), true),
        };
        if !hand_on(Line { number, text }) || is_last {
            return;
        }
    }
}

/// The next line, cut off just above the longest there may be; `None` at the end.
fn read_line(input: &mut impl BufRead) -> std::io::Result<Option<Vec<u8>>> {
    let (mut line, mut rest) = (Vec::new(), Vec::new());
    let mut read = input.by_ref().take(LONGEST_LINE + 1).read_until(b'\n', &mut line)?;
    if read == 0 {
        return Ok(None);
    }
    if line.len() as u64 > LONGEST_LINE {
        while read > 0 && line.last() != Some(&b'\n') && rest.last() != Some(&b'\n') {
            rest.clear();
            read = input.by_ref().take(LONGEST_LINE).read_until(b'\n', &mut rest)?;
        }
    }
    Ok(Some(line))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_numbered_empty_ones_skipped_and_endless_ones_cut() {
        let mut input = b"a\n\n \t\r\nb\n".to_vec();
        input.extend(vec![b'x'; 3 * LONGEST_LINE as usize]);
        input.extend(b"\nc");
        let mut lines = Vec::new();
        read_lines(input.as_slice(), |line| {
            lines.push((line.number, line.text.map(|text| String::from_utf8_lossy(&text).trim().to_owned())));
            true
        });
        let long = format!("the line is longer than {LONGEST_LINE} bytes");
        assert_eq!(lines, [(1, Ok("a".into())), (4, Ok("b".into())), (5, Err(long)), (6, Ok("c".into()))]);
    }
}
