// Only here to carry the headers that all tests share, compiled beforehand.
