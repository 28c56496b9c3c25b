//! Self-contained HTML pages.

use std::fmt::Write;

/// A page that grows from top to bottom.
#[derive(Debug, Default)]
pub struct Page {
    title: String,
    body: String,
}

const STYLE: &str = "\
body{font:15px/1.45 system-ui,sans-serif;color:#222;max-width:1180px;margin:2em auto;padding:0 1em}\
h1{font-size:1.6em;margin-bottom:.2em}h2{font-size:1.2em;margin:2em 0 .3em}p{max-width:70em}\
.about{color:#555}table{border-collapse:collapse;font-size:13px;margin:.6em 0}\
th,td{padding:.15em .8em;text-align:right;border-bottom:1px solid #e4e4e4}\
th:first-child,td:first-child{text-align:left}th{font-weight:600;border-bottom:1px solid #999}\
.row{display:flex;flex-wrap:wrap;gap:1em;align-items:flex-start}.row svg{max-width:100%;height:auto}\
figure{margin:0}figcaption{font-size:13px;color:#555}img{image-rendering:pixelated;max-width:100%}\
.bad{color:#b00020;font-weight:600}code{background:#f4f4f4;padding:.1em .3em}";

/// Text in HTML.
pub fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

impl Page {
    /// A page of this title.
    pub fn new(title: &str) -> Self {
        Self { title: title.into(), body: format!("<h1>{}</h1>\n", escape(title)) }
    }

    /// A heading.
    pub fn heading(&mut self, text: &str) {
        let _ = writeln!(self.body, "<h2>{}</h2>", escape(text));
    }

    /// A paragraph.
    pub fn text(&mut self, text: &str) {
        let _ = writeln!(self.body, "<p>{}</p>", escape(text));
    }

    /// What is said about the page, the device and the command line, smaller.
    pub fn about(&mut self, text: &str) {
        let _ = writeln!(self.body, "<p class=about>{}</p>", escape(text));
    }

    /// Plots, or pictures as PNG with a caption, side by side.
    pub fn row(&mut self, elements: &[String]) {
        let _ = writeln!(self.body, "<div class=row>{}</div>", elements.concat());
    }

    /// A table; rows for which it is said are marked.
    pub fn table(&mut self, headings: &[&str], rows: &[(Vec<String>, bool)]) {
        let cells = |row: &[String], tag: &str| {
            row.iter().map(|cell| format!("<{tag}>{}</{tag}>", escape(cell))).collect::<String>()
        };
        let headings: Vec<String> = headings.iter().map(|heading| (*heading).into()).collect();
        let _ = writeln!(self.body, "<table><tr>{}</tr>", cells(&headings, "th"));
        for (row, is_marked) in rows {
            let class = if *is_marked { " class=bad" } else { "" };
            let _ = writeln!(self.body, "<tr{class}>{}</tr>", cells(row, "td"));
        }
        self.body.push_str("</table>\n");
    }

    /// The whole page.
    pub fn html(&self) -> String {
        format!(
            "<!doctype html>\n<html lang=en><head><meta charset=utf-8>\
             <meta name=viewport content=\"width=device-width, initial-scale=1\">\n<title>{}</title>\n\
             <style>{STYLE}</style></head>\n<body>\n{}</body></html>\n",
            escape(&self.title),
            self.body
        )
    }
}

/// A picture for [`Page::row`] from the bytes of a PNG.
pub fn picture(png: &[u8], width: u32, caption: &str) -> String {
    use base64::Engine;
    let data = base64::engine::general_purpose::STANDARD.encode(png);
    format!(
        "<figure><img width={width} alt=\"{0}\" src=\"data:image/png;base64,{data}\"><figcaption>{0}</figcaption></figure>",
        escape(caption)
    )
}
