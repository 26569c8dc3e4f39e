"""From a free decay to a friction force in closed form: one class a method, one record or many."""
