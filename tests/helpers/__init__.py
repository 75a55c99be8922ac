"""What several tests share: random robots, the thesis's own equations, a child process of a sweep."""
