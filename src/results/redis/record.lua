-- Stores a report, publishes it to the servers that have listeners, and evicts what exceeds the
-- limits, in one atomic step. It follows forget.lua.
--
-- `senders`: the number of the last report that each server sent.
local senders = KEYS[6]
local channel, channel_of_all, sender, number = unpack(ARGV, 4, 7)
local received_at, persons, json, frame, sketch = unpack(ARGV, 8, 12)
local bytes = tonumber(ARGV[13])
local most_cameras, most_of_camera = tonumber(ARGV[14]), tonumber(ARGV[15])
local most_reports, most_bytes = tonumber(ARGV[16]), tonumber(ARGV[17])
local most_images, max_age_seconds = tonumber(ARGV[18]), tonumber(ARGV[19])
-- Most expired reports that one call removes: more in the first call of a second than in others.
local OLD_AT_A_TIME, OLD_IN_BETWEEN = 100, 2
-- Most servers whose last number is kept. The one with the oldest goes first.
local MOST_SENDERS = 4096

-- The report was stored before, but the answer was lost.
if redis.call('ZADD', senders, 'GT', 'CH', number, sender) == 0 then
  return
end

local state = redis.call('HMGET', totals, 'last', 'bytes')
local last, total = tonumber(state[1] or 0), tonumber(state[2] or 0)
local time = redis.call('TIME')
local now = time[1] * 1000000 + time[2]
local micros = string.format('%.0f', math.max(now, last + 1))
local oldest = string.format('%.0f', now - max_age_seconds * 1000000)
-- Expiry is renewed once a second, and for keys that may be new.
local is_new_second = math.floor(last / 1000000) ~= math.floor(now / 1000000)

-- Redis may have evicted one of the keys: start with an empty store then.
if is_new_second and redis.call('EXISTS', totals, cameras, latest) < 3 then
  redis.call('DEL', earlier, cameras, latest)
  total = 0
end

local stream = prefix_of_cameras .. camera
redis.call('XADD', stream, micros .. '-0', 'received_at', received_at, 'persons', persons, 'json', json)
local before = redis.call('HGET', latest, camera)
if before then
  redis.call('ZADD', earlier, string.match(before, '^%d+'), before .. ':' .. camera)
end
redis.call('HSET', latest, camera, micros .. ':' .. ARGV[13])
redis.call('ZADD', cameras, micros, camera)

local message = table.concat({micros, received_at, persons, json, camera}, '\n')
redis.call('SPUBLISH', channel, message)
redis.call('SPUBLISH', channel_of_all, message)

-- The image is that of the latest report. A report without an image removes it.
local is_first_image = false
if frame == '' then
  forget_image(camera)
else
  local image_key = prefix_of_images .. camera
  redis.call('DEL', image_key)
  redis.call('HSET', image_key, 'id', micros, 'frame', frame, 'sketch', sketch)
  redis.call('EXPIRE', image_key, max_age_seconds)
  redis.call('ZADD', images, micros, camera)
  local count = redis.call('ZCARD', images)
  is_first_image = count == 1
  for _ = most_images + 1, count do
    forget_image(redis.call('ZRANGE', images, 0, 0)[1])
  end
end

local most_old = is_new_second and OLD_AT_A_TIME or OLD_IN_BETWEEN
for _, old in ipairs(redis.call('ZRANGEBYSCORE', earlier, '-inf', oldest, 'LIMIT', 0, most_old)) do
  redis.call('ZREM', earlier, old)
  forget(old)
end
for _ = most_of_camera + 1, redis.call('XLEN', stream) do
  local first = redis.call('XRANGE', stream, '-', '+', 'COUNT', 1)[1][1]
  local score = string.match(first, '^%d+')
  local element = redis.call('ZRANGEBYSCORE', earlier, score, score)[1]
  if element then
    redis.call('ZREM', earlier, element)
    forget(element)
  else
    redis.call('XDEL', stream, first)
  end
end
if is_new_second or not before then
  for _, old in ipairs(redis.call('ZRANGEBYSCORE', cameras, '-inf', oldest, 'LIMIT', 0, OLD_AT_A_TIME)) do
    forget_camera(old)
  end
  for _ = most_cameras + 1, redis.call('ZCARD', cameras) do
    forget_camera(redis.call('ZRANGE', cameras, 0, 0)[1])
  end
end
local is_first_earlier = false
while true do
  local of_earlier, of_cameras = redis.call('ZCARD', earlier), redis.call('ZCARD', cameras)
  is_first_earlier = is_first_earlier or of_earlier == 1
  if of_earlier + of_cameras <= most_reports and total + bytes - freed <= most_bytes then
    break
  end
  local first = redis.call('ZPOPMIN', earlier)[1]
  if first then
    forget(first)
  elseif of_cameras > 0 then
    -- All remaining reports are their cameras' latest.
    forget_camera(redis.call('ZRANGE', cameras, 0, 0)[1])
  else
    break
  end
end

redis.call('HSET', totals, 'last', micros, 'bytes', string.format('%.0f', total + bytes - freed))
redis.call('EXPIRE', stream, max_age_seconds)
if is_new_second or is_first_earlier or is_first_image or not before then
  redis.call('ZREMRANGEBYSCORE', images, '-inf', oldest)
  redis.call('ZREMRANGEBYRANK', senders, 0, -MOST_SENDERS - 1)
  for _, key in ipairs({earlier, cameras, latest, totals, images, senders}) do
    redis.call('EXPIRE', key, max_age_seconds)
  end
end
