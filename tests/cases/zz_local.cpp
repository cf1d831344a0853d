namespace vivant {}
