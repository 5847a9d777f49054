//! A pull parser for the service's JSON: walks over the bytes of one frame, takes what is asked for and skips the rest.
//!
//! It allocates nothing and does not recurse on what it skips, so that no frame, however odd, costs more than its length.

/// The text is not JSON, or not of the shape that was asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Malformed;

/// A place in a text.
#[derive(Clone, Debug)]
pub(super) struct Json<'a> {
    text: &'a [u8],
    at: usize,
}

impl<'a> Json<'a> {
    pub(super) fn new(text: &'a [u8]) -> Self {
        Self { text, at: 0 }
    }

    /// The next byte that means something.
    pub(super) fn peek(&mut self) -> Result<u8, Malformed> {
        while let Some(&byte) = self.text.get(self.at) {
            if !matches!(byte, b' ' | b'\t' | b'\n' | b'\r') {
                return Ok(byte);
            }
            self.at += 1;
        }
        Err(Malformed)
    }

    fn take(&mut self, byte: u8) -> Result<(), Malformed> {
        if self.peek()? != byte {
            return Err(Malformed);
        }
        self.at += 1;
        Ok(())
    }

    /// Nothing but white space is left.
    pub(super) fn end(&mut self) -> Result<(), Malformed> {
        if self.peek().is_ok() { Err(Malformed) } else { Ok(()) }
    }

    /// Calls `entry` for each key; it must take or skip the value.
    pub(super) fn object(
        &mut self,
        mut entry: impl FnMut(&mut Self, &[u8]) -> Result<(), Malformed>,
    ) -> Result<(), Malformed> {
        self.take(b'{')?;
        if self.peek()? == b'}' {
            self.at += 1;
            return Ok(());
        }
        loop {
            let key = self.string()?;
            self.take(b':')?;
            entry(self, key)?;
            match self.peek()? {
                b',' => self.at += 1,
                b'}' => break,
                _ => return Err(Malformed),
            }
        }
        self.at += 1;
        Ok(())
    }

    /// Calls `item` at each item; it must take or skip it.
    pub(super) fn array(&mut self, mut item: impl FnMut(&mut Self) -> Result<(), Malformed>) -> Result<(), Malformed> {
        self.take(b'[')?;
        if self.peek()? == b']' {
            self.at += 1;
            return Ok(());
        }
        loop {
            item(self)?;
            match self.peek()? {
                b',' => self.at += 1,
                b']' => break,
                _ => return Err(Malformed),
            }
        }
        self.at += 1;
        Ok(())
    }

    /// The bytes between the quotes, escapes as they are written: no name that is looked for has one.
    pub(super) fn string(&mut self) -> Result<&'a [u8], Malformed> {
        self.take(b'"')?;
        let start = self.at;
        while let Some(&byte) = self.text.get(self.at) {
            match byte {
                b'"' => {
                    self.at += 1;
                    return Ok(&self.text[start..self.at - 1]);
                }
                b'\\' => self.at += 2,
                0..0x20 => return Err(Malformed),
                _ => self.at += 1,
            }
        }
        Err(Malformed)
    }

    /// A finite number: JSON has no others, and one beyond all doubles is none that can be used.
    pub(super) fn number(&mut self) -> Result<f64, Malformed> {
        self.peek()?;
        let start = self.at;
        let is_number = |byte: &u8| byte.is_ascii_digit() || matches!(byte, b'-' | b'+' | b'.' | b'e' | b'E');
        while self.text.get(self.at).is_some_and(is_number) {
            self.at += 1;
        }
        let text = std::str::from_utf8(&self.text[start..self.at]).map_err(|_| Malformed)?;
        text.parse().ok().filter(|number: &f64| number.is_finite()).ok_or(Malformed)
    }

    pub(super) fn boolean(&mut self) -> Result<bool, Malformed> {
        self.peek()?;
        for (word, value) in [(&b"true"[..], true), (b"false", false)] {
            if self.text[self.at..].starts_with(word) {
                self.at += word.len();
                return Ok(value);
            }
        }
        Err(Malformed)
    }

    /// Three numbers of an object with these keys, whatever else is in it.
    pub(super) fn vector(&mut self) -> Result<[f64; 3], Malformed> {
        let mut found = [None; 3];
        self.object(|json, key| {
            let axis = match key {
                b"x" => 0,
                b"y" => 1,
                b"z" => 2,
                _ => return json.skip(),
            };
            found[axis] = Some(json.number()?);
            Ok(())
        })?;
        match found {
            [Some(x), Some(y), Some(z)] => Ok([x, y, z]),
            _ => Err(Malformed),
        }
    }

    /// Steps over a value without looking into it any further than its brackets and strings.
    pub(super) fn skip(&mut self) -> Result<(), Malformed> {
        let mut depth = 0_usize;
        loop {
            match self.peek()? {
                b'{' | b'[' => {
                    depth += 1;
                    self.at += 1;
                }
                b'}' | b']' => {
                    depth = depth.checked_sub(1).ok_or(Malformed)?;
                    self.at += 1;
                }
                b'"' => {
                    self.string()?;
                }
                b',' | b':' if depth > 0 => self.at += 1,
                _ => self.word()?,
            }
            if depth == 0 {
                return Ok(());
            }
        }
    }

    /// Steps over a number, `true`, `false` or `null`.
    fn word(&mut self) -> Result<(), Malformed> {
        let start = self.at;
        let is_word = |byte: &u8| byte.is_ascii_alphanumeric() || matches!(byte, b'-' | b'+' | b'.');
        while self.text.get(self.at).is_some_and(is_word) {
            self.at += 1;
        }
        if self.at == start { Err(Malformed) } else { Ok(()) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn it_takes_what_is_asked_for_and_steps_over_the_rest() {
        let text = br#" {"a": [1, {"b": "}\"]"}, null], "p": {"z": -3e-1, "w": 0, "x": 1, "y": 2.5}, "t": true} "#;
        let (mut vector, mut truth) = (None, None);
        let mut json = Json::new(text);
        let taken = json.object(|json, key| {
            match key {
                b"p" => vector = Some(json.vector()?),
                b"t" => truth = Some(json.boolean()?),
                _ => json.skip()?,
            }
            Ok(())
        });
        assert_eq!((taken, json.end(), vector, truth), (Ok(()), Ok(()), Some([1.0, 2.5, -0.3]), Some(true)));
    }

    #[test]
    fn numbers_that_cannot_be_used_are_refused() {
        for text in ["NaN", "Infinity", "1e999", "-", "", "null", "\"1\"", "0x10"] {
            let mut json = Json::new(text.as_bytes());
            let number = json.number();
            assert!(number.is_err() || json.end().is_err(), "{text}: {number:?}");
        }
    }

    proptest! {
        // Check that nothing that can come over a socket makes it panic or run on for ever
        #[test]
        fn any_bytes_are_walked_over_without_a_panic(text in prop::collection::vec(any::<u8>(), 0..200)) {
            let _ = Json::new(&text).skip();
            let _ = Json::new(&text).object(|json, _| json.skip());
            let _ = Json::new(&text).array(|json| json.vector().map(|_| ()));
        }

        #[test]
        fn any_brackets_and_quotes_are_walked_over_without_a_panic(text in "[\\[\\]{}\",:\\\\a1 ]{0,100}") {
            let _ = Json::new(text.as_bytes()).skip();
            let _ = Json::new(text.as_bytes()).object(|json, _| json.skip());
        }
    }
}
