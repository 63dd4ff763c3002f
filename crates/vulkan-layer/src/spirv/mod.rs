//! Shaders rewritten, word by word: what is not touched stays as it is, known to us or not.
