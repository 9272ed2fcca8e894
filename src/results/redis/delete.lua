-- Deletes all reports of a camera and its image, in one atomic step. Returns 1 if it had reports.
--
-- The keys are those of record.lua.
local reports, earlier, cameras, totals, pictures = unpack(KEYS)
local stream, picture, camera = unpack(ARGV)

local found = redis.call('EXISTS', stream)
for _, entry in ipairs(redis.call('XRANGE', stream, '-', '+')) do
  local row = redis.call('XRANGE', reports, entry[1], entry[1])[1]
  if row then
    redis.call('XDEL', reports, entry[1])
    redis.call('HINCRBY', totals, 'bytes', -row[2][4])
  end
  redis.call('ZREM', earlier, entry[1])
end
redis.call('DEL', stream, picture)
redis.call('ZREM', cameras, camera)
redis.call('ZREM', pictures, camera)
return found
