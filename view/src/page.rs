//! The page: html, style and script in one answer, from files of this crate that are joined when it is compiled.

use palpate::Error;

/// The parts of the script, in the order in which they need each other.
const SCRIPT: &str = concat!(
    "\"use strict\";\n",
    include_str!("../page/state.js"),
    include_str!("../page/numbers.js"),
    include_str!("../page/matrix.js"),
    include_str!("../page/camera.js"),
    include_str!("../page/colour.js"),
    include_str!("../page/shapes.js"),
    include_str!("../page/surface.js"),
    include_str!("../page/painter.js"),
    include_str!("../page/timeline.js"),
    include_str!("../page/samples.js"),
    include_str!("../page/strips.js"),
    include_str!("../page/wire.js"),
    include_str!("../page/readout.js"),
    include_str!("../page/pointer.js"),
    include_str!("../page/gamepad.js"),
    include_str!("../page/keys.js"),
    include_str!("../page/panel.js"),
    include_str!("../page/player.js"),
    include_str!("../page/main.js"),
);
const STYLE: &str = include_str!("../page/view.css");
const BODY: &str = include_str!("../page/view.html");

/// The page and the policy that lets it do what it does and nothing else: its own script and style, by a word that is new every
/// time, and its own socket.
pub(crate) fn page(title: &str, host: &str) -> Result<(String, String), Error> {
    let nonce = crate::guard::Token::new()?;
    let nonce = nonce.text();
    let page = BODY
        .replace("{title}", &escaped(title))
        .replace("{style}", &format!("<style nonce=\"{nonce}\">{STYLE}</style>"))
        .replace("{script}", &format!("<script type=\"module\" nonce=\"{nonce}\">{SCRIPT}</script>"));
    let policy = format!(
        "Content-Security-Policy: default-src 'none'; script-src 'nonce-{nonce}'; style-src 'nonce-{nonce}'; \
         connect-src 'self' ws://{host}; img-src data: blob:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'\r\n"
    );
    Ok((page, policy))
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_page_asks_for_nothing_elsewhere_and_has_no_script_or_style_beside_its_own() {
        let (page, policy) = page("a <b> & \"c\"", "127.0.0.1:1").unwrap();
        assert!(page.contains("a &lt;b&gt; &amp; &quot;c&quot;"));
        for word in ["src=\"http", "href=\"http", "@import", "url(", " style=", "onclick", "eval(", "innerHTML"] {
            assert!(!page.contains(word), "{word}");
        }
        assert_eq!((page.matches("<script").count(), page.matches("<style").count()), (1, 1));
        assert!(!policy.contains("unsafe") && policy.contains("default-src 'none'"));
        assert_eq!(page.matches("nonce=").count(), 2);
    }
}
