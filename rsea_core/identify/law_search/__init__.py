"""The search for laws beside what multistep predictions leave: candidates, fits, confirmation."""
